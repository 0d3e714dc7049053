"""What a search has found so far: the models, how it came from one to the next, and what each round promised."""

from __future__ import annotations

from dataclasses import dataclass, field

from bushcli.diagnosis.criterion import NoiseTest, least_chi_square, noise_test
from bushcli.diagnosis.held_out import HeldOut
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.noise_model import Compared
from bushcli.diagnosis.result import Stage
from bushcli.diagnosis.rivals import Combination
from bushcli.diagnosis.score import Candidate, Score

# Misfit over noise up to which a model counts as having reached the noise, whatever the order of the samples says: what
# the literature accepts of a model is far above it.
AT_NOISE = 1.05
# Of what effects have taken away of the sum of squares, the share that they may leave because real rubber and real rigs
# follow no equation exactly: 10 % of an effect's curve, which is what the literature accepts of a model. No further
# effect is called for so little.
FORM = 0.01


@dataclass(frozen=True)
class Round:
    """What was promised beside a model.

    Attributes
    ----------
    base : Fitted
    table : list of Candidate
    scores : tuple of Score
    """

    base: Fitted
    table: list[Candidate]
    scores: tuple[Score, ...]


@dataclass
class Selection:
    """What the search has found so far.

    Attributes
    ----------
    plain, best : Fitted
        The plain law, and the model at hand.
    stages : list of (tuple of str, Stage)
        Each with its model's `structure`.
    rounds : list of Round
        The first beside the plain law.
    refits : dict
        Names of effects (and "law: ...") -> fit, of each name the one with the least BIC.
    combined : tuple of Combination
        Effects and pairs of them to first order beside the plain law.
    rough : Fitted, optional
        The best as it was compared with others, where those have a coarser mesh.
    held : tuple of HeldOut
    predictions, foretold : dict
        By `structure`, of models fitted without what is held out: misfit over noise on that, and all samples as they
        foretell them.
    """

    plain: Fitted
    best: Fitted
    stages: list[tuple[tuple[str, ...], Stage]] = field(default_factory=list)
    rounds: list[Round] = field(default_factory=list)
    refits: dict[tuple[str, ...], Fitted] = field(default_factory=dict)
    combined: tuple[Combination, ...] = ()
    rough: Fitted | None = None
    held: tuple[HeldOut, ...] = ()
    predictions: dict[tuple[str, ...], float] = field(default_factory=dict)
    foretold: dict[tuple[str, ...], tuple[Compared, ...] | None] = field(default_factory=dict)

    @property
    def compared(self) -> Fitted:
        """The best on the mesh of all others."""
        return self.rough or self.best


def key(model: Model, plain: Model) -> tuple[str, ...]:
    """Name of a model: its effects, each with its rig if it has one, and its law where that is not the plain one."""
    names = tuple(sorted(model.identities))
    if model.law != plain.law:
        return (f"law: {model.law}", *names)
    return (*names, "law: refitted") if plain.fixed and not model.fixed else names


def structure(model: Model, plain: Model) -> tuple[str, ...]:
    """Name of a model that also tells the number of an effect's branches: with the parameters of its effects."""
    return (*key(model, plain), *(e.full_name(p) for e in model.effects for p in e.parameters))


def at_noise(found: Fitted) -> NoiseTest | None:
    """The test by which the misfit is noise; None where it is not."""
    test = noise_test(found.judged, len(found.x))
    return test if test.is_noise or found.size <= AT_NOISE else None


def form_error(found: Selection) -> float:
    """What the effects of the model at hand may leave because their form is not quite that of the real ones."""
    explained = found.plain.chi_square - found.best.chi_square if found.best.model.effects else 0.0
    return max(0.0, FORM * explained)


def least_promise(found: Selection) -> float:
    """The least fall of chi square that has to be promised of an effect for it to be refitted.

    Half of what the form of the effects may err; nothing where more than that is left above the noise. There the law
    may have taken up most of a further effect, of which derivatives beside such a law promise little: an Ogden law that
    stiffens like a stop hides it.
    """
    form = form_error(found)
    left = found.best.chi_square * (1.0 - 1.0 / found.best.size**2)
    return 0.5 * form if left < form else 0.0


def most_gain(found: Fitted) -> float:
    """The most that chi square can fall from here: as far as noise goes, were it as small as it may be."""
    return found.chi_square - least_chi_square(found.channels, len(found.x))
