"""What a column's name says: the words and symbols of English, German, French and Spanish laboratories."""

import re
import unicodedata
from collections.abc import Mapping

SURE, PLAIN, VAGUE = 3, 2, 1  # "valve command", "weg", a single letter

_NOISE = (
    r"ist|istwert|act|actual|meas|measured|mess|messwert|mesure|signal|value|valeur|wert|sensor|capteur|raw|roh|brut|"
    r"data|daten|donnees|ch\d+|ai\d+|kanal|channel|voie|zyl|zylinder|cylinder|verin|jack|unfiltered|analog|untitled|"
    r"valor|medid[oa]|senal|canal|cilindro|of|the|de|du|des|del|der|la|le|el"
)
_FILTERED = re.compile(r"\b(?:filt\w*|gefiltert|lp|lowpass|smooth\w*|geglattet)\b")
_SOLL = (
    r"(?:soll\w*|set(?: ?(?:point|value|pt))?|consigne|consigna|demand|target|reference|referencia|ref|cmd|command|"
    r"commande|mando|comando|orden|fuhrungsgro\w*|sp)"
)
_VALVE = (
    r"(?:(?:servo ?)?(?:valve|ventil|vanne|valvula)|servo|sv|spool|schieber|steuerschieber|tiroir|distributeur|"
    r"corredera|xv|drive)"
)
_WEG = (
    r"(?:position|pos|posn|posicion|weg|kolbenweg|hub|lage|stroke|course|carrera|deplacement|displacement|"
    r"desplazamiento|disp|x|xp|piston|kolben)"
)
_OIL = (
    r"(?:p|press|pressures?|drucke?|kammerdrucke?|pressions?|presion|pr|dr|chamber|kammer|chambre|camara|port|"
    r"anschluss)"
)
_PRESSURE = rf"{_OIL}(?: {_OIL})?"  # "pression chambre"

_WORDS: Mapping[str, Mapping[int, str]] = {
    "t": {
        SURE: (
            r"time|zeit|temps|(?:time ?)?stamp|tout|elapsed(?: time)?|zeitstempel|horodatage|messzeit|"
            r"(?:datum|date)(?: (?:\w*zeit|time|heure))?|time (?:axis|vector)|(?:time|zeit|temps|tiempo) s|uhrzeit|"
            r"heure|"
            r"sekunden|seconds|tiempo"
        ),
        PLAIN: (r"t|tps|x ?value"),
    },
    "command": {
        SURE: (
            rf"{_VALVE}(?: {_WEG})? ?{_SOLL}|{_SOLL}(?: {_WEG})? {_VALVE}|"
            rf"{_VALVE} (?:input|signal|voltage|volts?|u|in|ansteuerung|opening|spannung|tension|output)|command|cmd|"
            rf"(?:voltage|spannung|tension) {_VALVE}|"
            r"commande|comando|stellgro\w*|stellsignal|control(?: signal| output| voltage| variable)|"
            r"ventilansteuerung|ventilspannung|"
            r"steuerspannung|steuersignal|controller output|reglerausgang|drive (?:signal|output)|"
            rf"commande (?:vanne|servovanne)|u ?(?:v|sv|cmd|valve|ventil|servo)|{_SOLL} ?u"
        ),
        PLAIN: (r"stell\w*|ansteuerung|u|(?:(?:servo ?)?(?:valve|ventil|vanne|valvula)|servo)(?: v)?"),
        VAGUE: (rf"control|ao\d*|dac\d*|{_SOLL}|spannung|voltage|tension"),
    },
    "reference": {
        SURE: (rf"{_WEG} ?{_SOLL}|{_SOLL} {_WEG}|x ?(?:soll|ref|d|des|cmd)|reference|consigne (?:de )?position"),
        PLAIN: (rf"{_SOLL}|fuhrungsgro\w*|w|r"),
    },
    "spool": {
        SURE: (
            rf"(?:spool|schieber\w*|tiroir|corredera|ventilschieber|main stage|hauptstufe)(?: {_WEG})?|"
            rf"(?:valve|ventil|vanne|valvula) ?{_WEG}|{_WEG} (?:valve|ventil|vanne|valvula|spool|schieber|tiroir|"
            rf"corredera)|ventilweg|ventilhub|"
            r"ventilposition|schieberweg|x ?v|y ?(?:v|s|ventil|spool)|spool lvdt|lvdt (?:valve|spool|ventil)"
        ),
        PLAIN: (r"x3|z3|ys|xs"),
    },
    "pa": {
        SURE: (
            rf"p ?a|{_PRESSURE} ?a|a {_PRESSURE}|p ?cap|cap(?: side| end)?(?: {_PRESSURE})?|"
            rf"(?:head|bore|piston|blind) (?:side|end)(?: {_PRESSURE})?|"
            rf"{_PRESSURE} (?:cap|head|bore|kolbenseit\w*|piston side|fond)(?: side| end)?|"
            rf"kolbenseite(?: {_PRESSURE})?|p ?(?:kolben|piston|head|bore|fond)"
        ),
        VAGUE: (rf"{_PRESSURE} ?0?1"),
    },
    "pb": {
        SURE: (
            rf"p ?b|{_PRESSURE} ?b|b {_PRESSURE}|(?:rod|annulus|gland) (?:side|end)(?: {_PRESSURE})?|"
            rf"{_PRESSURE} (?:rod|annulus|stangenseit\w*|ringseit\w*|tige)(?: side| end)?|"
            rf"(?:stangenseite|ringseite)(?: {_PRESSURE})?|p ?(?:rod|stange|ring|tige|annulus)"
        ),
        VAGUE: (rf"{_PRESSURE} ?0?2"),
    },
    "load_pressure": {
        SURE: (
            rf"load pressure|lastdruck|differenzdruck|druckdifferenz|{_PRESSURE} (?:diff\w*|l|load|last|de charge)|"
            rf"diff\w* {_PRESSURE}|pression (?:de charge|differentielle)|p ?l|p ?load|p ?last|delta p|dp|d p|pl"
        ),
        VAGUE: (r"p"),
    },
    "supply": {
        SURE: (
            r"p ?(?:s|0|sup|supply|sys|system|pump|pumpe|versorgung|v|hp|alim)|"
            rf"(?:supply|system|pump|versorgungs|pumpen|line|feed|hp)(?: {_PRESSURE})?|"
            r"(?:versorgungs|system|pumpen|speise|netz)druck|"
            rf"{_PRESSURE} (?:s|0|supply|system|pump|pumpe|versorgung|p|alimentation|alim|d alimentation|pompe|hp|"
            rf"alimentacion|"
            r"bomba|suministro)|"
            r"supply"
        ),
    },
    "position": {
        SURE: (
            rf"{_WEG} {_WEG}|(?:actuator|ram|piston|rod|kolben|stangen?) ?{_WEG}|position|weg|kolbenweg|"
            r"kolbenposition|deplacement|displacement|stroke|hub|course|x ?p|lvdt (?:piston|kolben|ram|actuator)|"
            r"poloha|wegaufnehmer|travel|posicion|desplazamiento|carrera"
        ),
        PLAIN: (r"pos|posn|disp|x|x1|lage|s|y|xk|lvdt|encoder|codeur|dep|depl"),
        VAGUE: (r"way|distance|abstand|piston|kolben"),
    },
    "velocity": {
        SURE: (
            r"velocity|speed|geschwindigkeit|vitesse|velocidad|(?:x|xp|x1|y|pos|weg) ?(?:dot|p(?:unkt)|point)|"
            r"(?:kolben)?geschw\w*|vel|rychlost"
        ),
        PLAIN: (r"v|dx|xd|x1d|x2|vp|dxdt|dx dt"),
    },
    "acceleration": {
        SURE: (
            r"acceleration|accelero\w*|accel\w*|beschl\w*|(?:x|xp|x1|y) ?(?:ddot|dot dot|pp|punktpunkt)|acc|ddx|"
            r"zrychleni|aceleracion"
        ),
        PLAIN: (r"a|ax|az|ay|gamma|b|x1dd|xdd"),
    },
    "force": {
        SURE: (
            r"force|kraft|load ?cell|kraftmess\w*|kraftaufnehmer|effort|kmd|f ?(?:load|last|z|zyl|cell)|"
            r"(?:zylinder|kolben|last|pruf)kraft|cellule(?: d effort| de force)?|sila|fuerza|"
            r"c[ae]lda(?: de)? carga"
        ),
        PLAIN: (r"f|fx|fz|load|last|charge|carga|lc|dms"),
    },
    "current": {
        SURE: (
            r"current|strom|courant|corriente|(?:ventil|spulen|servo|magnet)strom|i ?(?:v|sv|valve|ventil|coil|spule|"
            r"servo)|"
            rf"(?:coil|pilot|{_VALVE})(?: valve)? ?(?:current|strom|courant|corriente)|"
            rf"(?:courant|strom|current|corriente) (?:bobina|bobine|spule|coil|pilot|{_VALVE})"
        ),
        PLAIN: (r"i|i1"),
    },
}
_CONTROLLED = (
    r"(?:force|kraft|fuerza|effort|f|pressure|druck|pression|presion|p|load|velocity|geschwindigkeit|vitesse|velocidad|"
    r"v|speed)"
)
_OTHER = re.compile(
    rf"{_CONTROLLED} ?{_SOLL}|{_SOLL} {_CONTROLLED}|"
    r".*\b(?:tank|rucklauf|retour|return|temp\w*|oil|direction|richtung|trigger|index|samples?|n|nr|count\w*|"
    r"zahler)\b.*|"
    r"p ?t|p ?r"
)
_COMPILED = {name: {strength: re.compile(pattern) for strength, pattern in by.items()} for name, by in _WORDS.items()}


def strengths(name: str) -> dict[str, int]:
    """The signals that a name may mean, each with how clearly; none for a name that means something else."""
    plain, stripped = words(name), _without_noise(words(name))
    if _OTHER.fullmatch(plain) and not any(by[SURE].fullmatch(plain) for by in _COMPILED.values()):
        return {}
    meant = {}
    for signal, by in _COMPILED.items():
        fits = [strength for strength, pattern in by.items() if pattern.fullmatch(stripped) or pattern.fullmatch(plain)]
        if fits:
            meant[signal] = max(fits)
    best = max(meant.values(), default=0)
    return {signal: strength for signal, strength in meant.items() if strength == best or best < SURE}


def is_filtered(name: str) -> bool:
    """Whether a name says that its numbers went through a filter."""
    return bool(_FILTERED.search(words(name))) and not re.search(r"\b(?:un|non|bez|ohne|sans|without)\b", words(name))


def words(name: str) -> str:
    """A name in small letters without accents, its parts apart: "p_A" and "pA" are "p a", "x1_dot" is "x1 dot"."""
    name = name.strip(" ./").rsplit(".", 1)[-1].rsplit("/", 1)[-1].replace("ß", "ss")
    bare = "".join(c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    apart = re.sub(r"([a-z])([A-Z])", r"\1 \2", bare)
    return " ".join(re.findall(r"[a-z0-9]+", apart.lower()))


def _without_noise(plain: str) -> str:
    kept = [word for word in _FILTERED.sub(" ", plain).split() if not re.fullmatch(_NOISE, word)]
    return " ".join(kept) or plain
