"""The table of all that was thought of."""

from __future__ import annotations

import numpy as np

from bushcli.diagnosis.result import Hypothesis
from bushcli.diagnosis.selected import Selection, hypothesis, key
from bushcli.effect import spoken


def hypotheses(found: Selection) -> tuple[Hypothesis, ...]:
    """All that was thought of, the best refits first, then the most promising, then what cannot be tested."""
    scores = found.rounds[0].scores if found.rounds else ()
    rows = []
    plain = found.plain.bic()
    for score in scores:
        refit = found.refits.get((hypothesis(score.name, score.channels),))
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
                chosen=score.name in found.best.model.names,
                channels=score.channels,
            )
        )
    for name, refit in found.refits.items():
        if name and (len(name) > 1 or name[0].startswith("law")):
            chosen = key(found.best.model, found.plain.model) == name
            rows.append(
                Hypothesis(
                    " + ".join(map(spoken, name)),
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
