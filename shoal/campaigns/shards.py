"""Parts of a campaign that are done in different places, each with a data set of its own."""

import re
from dataclasses import dataclass
from pathlib import Path

from shoal.campaigns.pass_rate import StoppingRule

MAX_SHARDS = 100_000  # shards
_SHARD = re.compile(r"\s*(\d{1,6})\s*/\s*(\d{1,6})\s*")


@dataclass(frozen=True)
class Shard:
    """Part `number` of `count`, from 1 on: each `count`-th run, so that all parts have about the same work."""

    number: int
    count: int

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def folder_name(self) -> str:
        """The name of its data set inside the folder of the campaign; names sort as numbers do."""
        return f"shard-{self.number:0{len(str(self.count))}d}-of-{self.count}"

    def runs(self, most: int) -> range:
        """The runs of this shard out of `most`."""
        return range(self.number - 1, most, self.count)


WHOLE_CAMPAIGN = Shard(1, 1)


def parse_shard(text: str) -> Shard:
    """The shard that a text such as 3/16 names. Raises ValueError."""
    match = _SHARD.fullmatch(text)
    number, count = (int(match.group(1)), int(match.group(2))) if match else (0, 0)
    if not 1 <= number <= count <= MAX_SHARDS:
        hint = "; the first is 1" if match and number == 0 and count else ""
        raise ValueError(f"{text!r} is not a shard such as 3/16, the third of sixteen{hint}")
    return Shard(number, count)


def shard_folder(folder: Path, shard: Shard) -> Path:
    """Folder of the data set of a shard; that of the whole campaign is `folder`."""
    return folder if shard == WHOLE_CAMPAIGN else folder / shard.folder_name


def check_shard_stopping(shard: Shard, ending: StoppingRule) -> None:
    """Raise ValueError if a part cannot see when the whole is over."""
    if shard != WHOLE_CAMPAIGN and ending.target_width is not None:
        raise ValueError(
            f"until: shard {shard} cannot compute the interval of all shards' pass rate; give --runs NUMBER"
        )
