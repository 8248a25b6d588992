"""Names of at most 16 characters for the parameters of a vehicle."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from zlib import crc32

LONGEST = 16
LABEL_LETTERS = 6
SHORTEST = 3  # letters of a word that is cut
BASE32 = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"
VOWELS = "AEIOU"
SHORT: Mapping[str, str] = {
    **dict.fromkeys(("OF", "THE", "AND", "FOR", "TO", "PER", "IF", "AT", "IS", "MANEUVER"), ""),
    "ACCELERATION": "ACC",
    "ACCELEROMETER": "ACC",
    "ACTIVATION": "ACTV",
    "ACTUATION": "ACTU",
    "ALTITUDE": "ALT",
    "ATTITUDE": "ATT",
    "BATTERIES": "BATT",
    "BATTERY": "BATT",
    "BOTTOM": "BOT",
    "CAMERA": "CAM",
    "CONTROL": "CTL",
    "CONTROLLER": "CTL",
    "COVARIANCE": "COV",
    "CURRENT": "CURR",
    "DATABASE": "DB",
    "DEACTIVATION": "DEAC",
    "DEBUG": "DBG",
    "DEFAULT": "DEF",
    "DEVIATION": "DEV",
    "DISTANCE": "DIST",
    "DURATION": "DUR",
    "ENABLED": "ENA",
    "ENGINE": "ENG",
    "EXECUTION": "EXEC",
    "FREQUENCY": "FREQ",
    "GENERATOR": "GEN",
    "HEADING": "HDG",
    "HYSTERESIS": "HYST",
    "INITIAL": "INI",
    "INTEGRAL": "INT",
    "LEVEL": "LVL",
    "LIMIT": "LIM",
    "LIMITS": "LIM",
    "MAXIMUM": "MAX",
    "MINIMUM": "MIN",
    "MONITOR": "MON",
    "NAVIGATION": "NAV",
    "NUMBER": "NUM",
    "OPERATIONAL": "OP",
    "POSITION": "POS",
    "PROPORTIONAL": "P",
    "RADIUS": "RAD",
    "REFERENCE": "REF",
    "REVOLUTIONS": "RPM",
    "SENSOR": "SENS",
    "SIMULATOR": "SIM",
    "SPEED": "SPD",
    "STANDARD": "STD",
    "STATION": "STN",
    "SUPERVISOR": "SUP",
    "TEMPERATURE": "TEMP",
    "THRESHOLD": "THR",
    "TIMEOUT": "TOUT",
    "UNCERTAINTY": "UNC",
    "VELOCITY": "VEL",
    "VEHICLE": "VEH",
}
"""Abbreviations of frequent words where the name in full is too long; to be changed only with great care: stations
store parameters by name."""
STANDARD: Mapping[str, tuple[str, str]] = {"MIS_TAKEOFF_ALT": ("MAVLink", "Takeoff Altitude")}
"""Names that MAVSDK reads and sets without a list, as of a PX4, with the entity label and parameter that each means."""


def parameter_ids(names: Iterable[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """MAVLink names for pairs of entity label and parameter, sorted.

    A name that fits is kept ("IMU", "Gyro Noise": IMU_GYRO_NOISE), others are abbreviated. Of those that would be the
    same, all end in two characters of a checksum: a name never depends on the order of tasks.
    """
    pairs = sorted(set(names))
    found = {pair: parameter_id(*pair) for pair in pairs}
    twice = {name for name, count in Counter(found.values()).items() if count > 1}
    chosen = {pair: name for pair, name in found.items() if name not in twice and name}
    taken = set(chosen.values())
    for pair in pairs:
        if pair not in chosen:
            salt = crc32("\0".join(pair).encode(errors="surrogateescape"))
            while (name := _salted(found[pair], salt)) in taken:
                salt += 1
            chosen[pair] = name
            taken.add(name)
    return dict(sorted(chosen.items(), key=lambda item: item[1]))


def parameter_id(label: str, parameter: str) -> str:
    """The name of a parameter by itself, empty if no letter or digit is in it."""
    whole = "_".join(_words(label) + _words(parameter))
    if len(whole) <= LONGEST:
        return whole
    head = _fitted(_short(label), LABEL_LETTERS).replace("_", "")
    rest = _fitted(_short(parameter), LONGEST - len(head) - bool(head))
    return "_".join(part for part in (head, rest) if part)


def _words(text: str) -> list[str]:
    return [word.upper() for word in re.findall(r"[A-Z]{2,}s\b|[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", text)]


def _short(text: str) -> list[str]:
    words = _words(text)
    return [short for word in words if (short := SHORT.get(word, word))] or words


def _fitted(words: list[str], letters: int) -> str:
    """The words in at most `letters` characters: the longest loses vowels first, then its end; then the joints go."""
    words = list(words)
    for joint, shortest in (("_", SHORTEST), ("", 1)):
        while len(joint.join(words)) > letters:
            longest = max(range(len(words)), key=lambda i: (len(words[i]), i))
            word = words[longest]
            if len(word) <= shortest:
                break
            vowels = [i for i in range(1, len(word)) if word[i] in VOWELS]
            cut = vowels[-1] if vowels else len(word) - 1
            words[longest] = word[:cut] + word[cut + 1 :]
        else:
            return joint.join(words)
    return "".join(words)[:letters]


def _salted(stem: str, salt: int) -> str:
    stem = stem[: LONGEST - 3].rstrip("_")
    return (stem + "_" if stem else "") + BASE32[salt % 32] + BASE32[salt // 32 % 32]
