"""Words in the names of columns: those for quantities, those that change a meaning, and those that do neither.

`name_quality` says how surely the words of a name mean a quantity.
"""

from __future__ import annotations

import re
from functools import lru_cache

from bushcli.recording.quantities import SPECIAL, STATIC, word_set
from cases.mode import modes

#: Words that change the meaning: a true stress is not a nominal stress; a set value, a rate, an error, an extreme or a
#: counter is not a measured value.
_FOREIGN = word_set(
    "true wahre cauchy log logarithmic hencky set setpoint command cmd soll sollwert demand target reference ref "
    "desired rate speed velocity acceleration error err deviation fehler abweichung step steps schritt count counts "
    "counter number index id cycle cycles zyklus segment limit status mode min max minimum maximum minimal maximal "
    "mean avg average mittelwert peak valley rms std range amplitude frequency temperature temp work energy power "
    "stiffness integral derivative offset remaining date noise geschwindigkeit delta tolerance increment sp dt phase "
    "sigma variance uncertainty valid squared normalized normalised normiert specific spezifische "
    "modulus commanded programmed program request requested vorgabe führungsgröße regelabweichung consigne ideal "
    "expected simulated simulation model fit fitted residual difference calc calculated computed estimated estimate "
    "theory theoretical preload vorlast friction seal inertia trigger alarm level block direction type units flag "
    "quality slope gradient trend vs versus per initial tare fmax fmin lastwechsel laststufe lastspiel "
    "hold feedforward sinus green almansi piola kirchhoff pk pk2 shear diff δ predicted prediction pred fem fea sim "
    "theor computed specified rated extrapolated abaqus ansys magnitude betrag reduced reduzierte mooney mises "
    "equivalent deviatoric deviator hydrostatic berechnet rechnerisch consigna comando riferimento erreur errore "
    "vitesse velocità velocidad maximal maximale minimale massimo massima minimo minima máximo máxima mínimo mínima "
    "moyen moyenne medio media"
)
#: The same in languages with endings or without blanks: extremes and means; set, calculated and simulated values;
#: errors; rates, stiffness, energy.
_ABROAD = re.compile(
    r"^(?:maxi|maks|máxim|massim|макс|мин(?!$)|średni|gemiddel|ortalama|средн|pics?$|picchi?|picco|picos?$|crête|piek|szczyt|пик"
    r"|referen|référen|referên|impost|zadan|żądan|žádan|požad|hedef|gewenst|gewünscht|цел|задан|setpun|set-?point"
    r"|t(?:h)?[eéè]or|teór|calcul|berek|oblicz|vypočt|расч|simul(?!t)|symul|модел|erreu|fout|błęd|błąd|chyb|hata|ошиб"
    r"|raideur|rigid[ei]|stijfh|sztywn|tuhost|жестк|жёстк|énerg|energi|energí|энерг|snelh|prędk|rychlo|скорост)"
    r"|börvärd|børværd|最大|最小|峰值|峰谷|平均|设定|設定|目标|目標|指令|给定|給定|理论|理論|计算|計算|模拟|误差|誤差|偏差"
    r"|变化率|速率|速度|刚度|剛性|能量|次数|回数|목표|평균|최대|최소|지령|설정|이론|오차|속도"
)
#: The words above that, in brackets, are what a column counts: Time [cycles].
COUNTED_WORDS = word_set(
    "count counts counter number index id cycle cycles zyklus step steps schritt segment units"
)
#: The same for a strain: one across the direction of the load.
ACROSS = word_set("transverse lateral quer")
#: Words for the extremes of a cycle.
EXTREME_WORDS = word_set(
    "min max minimum maximum minimal maximal peak valley mean avg average mittelwert range amplitude"
)
FOREIGN_BEGINNINGS = (
    "soll", "max", "min", "grenz", "rest", "höchst", "bruch", "mittel", "vorlast", "vorkraft", "vorspann", "vorgabe",
    "reib", "klemm", "halte", "regel", "führungs", "querdehn", "zyklus", "perioden", "differenz", "betrags",
    "vergleichs",
)  # fmt: skip
#: The same at the end of a word: ForceRate.
_FOREIGN_ENDINGS = (
    "rate", "error", "fehler", "setpoint", "command", "demand", "increment", "geschwindigkeit", "sollwert", "vorgabe",
    "grenze", "abweichung", "differenz", "zahl", "zähler", "schritt", "betrag",
)  # fmt: skip
#: Words for measured values.
MEASURED_WORDS = word_set("measured actual feedback fbk ist istwert gemessen messwert response")
#: Words beside that for a quantity that are not units and do not change the meaning.
_BESIDE = MEASURED_WORDS | word_set(
    "axial radial torsional conical x y z r a b c u v w i ii l q ch chan channel kanal raw filt corr cell dose sensor "
    "lvdt mts hbm pcb ni daq dic cam cyl rig test part dut mess main top bot left right up down vert hor lin rot rad "
    "ax tor abs rel total net eng nom of the on at from in for data wert value ai ao sig no nr mid low high "
    "probe prüf inner outer sleeve filtered corrected calibrated smoothed uncalibrated scaled zeroed tared signal "
    "input output vertical horizontal lateral transverse longitudinal front rear specimen sample bushing bush damper "
    "actuator transducer extensometer laser encoder analog digital primary secondary standard upper lower frame bench "
    "machine piston cylinder beam plate clamp side prüfstand prüfmaschine kolben zylinder taster aufnehmer traverse "
    "messdose kraftmessdose seite oben unten links rechts innen außen pure linear rotary static dynamic quasi axis "
    "dir achse richtung lc loadcell rvdt optical optisch video clip dynacell instron zwick kistler temposonics "
    "compression tension compressive tensile zug druck positive positiv "
    # How a signal was processed; its unit remains.
    "unfiltered gefiltert ungefiltert tariert genullt nullgesetzt korrigiert kalibriert geglättet roh rohsignal "
    "rohdaten rohwert kompensiert bereinigt filtré filtrée corrigé corrigée mesuré mesurée brut brute filtrata "
    "misurata compensated removed subtracted resampled decimated interpolated detrended collected formula result "
    "reading col column spalte pass lowpass fast slow old new final stamp fx fy fz mx my mz dl δl"
)
#: Words that a remark in brackets may contain beside others, but does not consist of.
FILLING = word_set("a b c i ii l q r u v w of the on at from in for and")
#: Words that are remarks in brackets: they tell where and how a value was measured, and nothing about its unit.
REMARKS = _BESIDE - FILLING - word_set("rel eng nom scaled uncalibrated dl δl")
#: What was subtracted from a signal or corrected in it: a force without offset is a force.
_CORRECTED = "offset|inertia|friction|tare|mean|temperature|temp|noise|drift|preload|reib(?:ung)?|vorlast"
_SENSORS = r"lvdts?|sensors?|lasers?|channels?|cells?|transducers?|sensoren|kanäle"
#: Words that change the meaning of a quantity alone, but not in these phrases, in lower case with single blanks.
HARMLESS = re.compile(
    rf"\b(?:{_CORRECTED}) (?:corrected|compensated|removed|subtracted|free|korrigiert|kompensiert|bereinigt)\b"
    rf"|\b(?:without|w o|ohne|no|minus|incl|inkl|including|with|mit) (?:{_CORRECTED})\b"
    r"|\b(?:in )?[xyz] direction\b"
    # The range of a sensor, and the speed of a test: "range 10 kN", "10 mm/min".
    r"|\brange \d+ ?(?:k?n|mm|lbf|in)\b|\b\d+ ?(?:k?n|mm|lbf|in) range\b"
    r"|\b(?:rate |speed )?\d+ ?(?:mm|in|deg) (?:min|s)\b"
    r"|\b(?:f?max|nom|nominal|rated|capacity|nenn|nennkraft|nennlast) \d+ ?(?:k?n|mm|lbf|in)\b"
    # The values of one cycle; a count of cycles has no number.
    r"|\b(?:cycle|zyklus) \d+\b|\b\d+(?:st|nd|rd|th) cycle\b|\b\d+ zyklus\b"
    # The mean of sensors, not of cycles.
    rf"|\b(?:avg|average|mean|mittel|mittelwert) (?:of|aus|von) (?:(?:[2-4]|two|three|four|both|zwei|drei|vier|beiden)"
    rf"(?= (?:{_SENSORS})\b|$)|(?={_SENSORS}))"
)
#: Words before the number of a channel.
NUMBERED_WORDS = word_set("channel chan ch kanal kan ai di input eingang sensor nr no number signal")
#: A factor beside a unit: "x10 N", "1000 N".
POWER = re.compile(r"[x×*]?10+|1[eE]\d")
#: Names of devices and channels: MX840B, LC2, U10M. What may be a unit is none, with or without an exponent.
_CODE = re.compile(r"([A-Z]{2,4})\d{1,4}[A-Z]?|[A-Z]\d{1,4}[A-Z]|(?:c?DAQ|[Dd]ev|[Mm]od|[Ss]lot)\d{1,3}")
_UNITS = re.compile(
    r".*(?:M|IN|FT)|[KD]?A?N|K?GF?|KP|K?LBF?S?|KIPS?|OZF?|TONS?|MILS?|THOU|[KMG]?PA|[PK]SI|M?BAR|M?[VA]|ADC"
    r"|DAC|DIG|INC|LSB|GAIN|DIV|MULT?|FAKT?|FACT?|EXP|BITS?|CNTS?|VDC|M?SEC|MIN|HRS?|DEGS?|M?RAD|PCT"
)
_ENDINGS = tuple(end for quantity in STATIC.values() for end in quantity.endings)
#: Words for a quantity.
QUANTITY_WORDS = word_set(" ".join(name for each in STATIC.values() for name in (*each.words, *each.weak)))


def is_foreign(word: str) -> bool:
    """Whether a word, in lower case, changes the meaning of the quantity beside it."""
    return word in _FOREIGN or word.endswith(_FOREIGN_ENDINGS) or _ABROAD.search(word) is not None


def is_code(word: str) -> bool:
    """Whether a word is the name of a device or channel, such as MX840B, LC2, U10M, and no unit with a number."""
    match = _CODE.fullmatch(word)
    return match is not None and not _UNITS.fullmatch(match[1] or "")


def known_word(word: str) -> bool:
    """Whether a word belongs to names of columns and is therefore not a unit; digits behind it do not count."""
    if POWER.fullmatch(word):
        return False
    if is_code(word):
        return True
    plain = word.lower().rstrip("0123456789")
    if plain[:1].isdigit():
        # "2Force" is a channel; "10V" is a number and a unit.
        plain = plain.lstrip("0123456789")
        return len(plain) > 1 and plain in QUANTITY_WORDS
    return (
        not plain
        or plain in QUANTITY_WORDS
        or is_foreign(plain)
        or plain in _BESIDE
        or any(len(plain) > len(end) and plain.endswith(end) for end in _ENDINGS)
    )


def plain_name(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())


@lru_cache(maxsize=8192)
def name_quality(name: str, kind: str) -> int:
    """Return how surely a name means a quantity, a key of `STATIC` or `SPECIAL`.

    0 not at all; 1 a German compound; 2 a word for it among others; 3 a word for it; 4 this project's own name. The
    name of a mode does not count: "axial displacement" means as surely a length as "displacement".
    """
    if kind in SPECIAL:
        # "Volume ratio J", "Pressure p": the name and its symbol.
        known = SPECIAL[kind].words
        plain = " ".join(word for word in name.split() if len(word) > 1 or word not in known)
        within = any(len(word) > 1 and f" {word} " in f" {name} " for word in known)
        own, whole = known[0] in (name, plain), name in known or plain in known
        rules: tuple[tuple[object, int], ...] = ((own, 4), (whole, 3), (within, 2))
    else:
        quantity, words = STATIC[kind], [word for word in name.split() if word not in modes()]
        known, name = quantity.words, " ".join(words)
        # "extension ratio" contains a word for a length but is a stretch; any other ratio is none.
        phrase = any(" " in word and f" {word} " in f" {name} " for word in known)
        other = "ratio" in words and not phrase
        other |= any(name in each.words for each in STATIC.values() if each is not quantity)
        longest = max((end for end in _ENDINGS if name.endswith(end)), key=len, default="")
        compound = longest in quantity.endings and not name.startswith(FOREIGN_BEGINNINGS)
        rules = (
            (kind in ("strain", "stretch") and ACROSS & set(words), 0),
            # It counts something; "Force no 2" is a channel.
            (len(words) > 1 and words[-1] in ("no", "nr"), 0),
            (name == known[0], 4),
            (name in known, 3),
            (any(len(word) > 1 and word in words for word in known), 0 if other else 2),
            (any(word in words for word in quantity.weak) or compound, 1),
        )
    return next((quality for holds, quality in rules if holds), 0)


def kinds_of(text: str) -> set[str]:
    """Return the quantities that a text may name."""
    return {kind for kind in STATIC if name_quality(plain_name(text), kind)}
