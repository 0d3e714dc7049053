"""The table of all that was thought of."""

from __future__ import annotations

import numpy as np

from bushcli.active import identity
from bushcli.diagnosis.result import Hypothesis
from bushcli.diagnosis.selected import Selection, key
from bushcli.effect import effect_name, effects, spoken


def hypotheses(found: Selection) -> tuple[Hypothesis, ...]:
    """All that was thought of, the best refits first, then the most promising, then what cannot be tested."""
    scores = found.rounds[0].scores if found.rounds else ()
    rows = []
    plain = found.plain.bic()
    alone = set()
    for score in scores:
        name = identity(effects()[effect_name(score.name)], score.channels)
        alone.add(name)
        refit = found.refits.get((name,))
        rows.append(
            Hypothesis(
                name=score.name,
                testable=score.testable,
                reason=score.reason,
                drop=score.drop,
                z=score.z,
                p=score.p,
                amplitude=dict(score.amplitude) | dict(score.shape) if score.testable else {},
                refitted=refit is not None,
                bic=float("nan") if refit is None else refit.bic() - plain,
                misfit=float("nan") if refit is None else refit.size,
                chosen=name in found.best.model.identities,
                channels=score.channels,
            )
        )
    for names, refit in found.refits.items():
        # An effect may promise most in one rig, and do most in another.
        if names and (len(names) > 1 or names[0] not in alone):
            chosen = key(found.best.model, found.plain.model) == names
            rows.append(
                Hypothesis(
                    " + ".join(map(spoken, names)),
                    True,
                    "",
                    float("nan"),
                    float("nan"),
                    float("nan"),
                    {},
                    True,
                    refit.bic() - plain,
                    refit.size,
                    chosen,
                )
            )
    return tuple(
        sorted(
            rows,
            key=lambda row: (not row.testable, row.bic if row.refitted else 0.0, -np.nan_to_num(row.drop)),
        )
    )
