"""Copies of a study's files, so that its runs are the same on every computer and after changes to the files."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from runtime.profile import user_etc
from shoal.campaigns.studies.bundle_workspace import BundleError, Workspace, rebase_path
from shoal.campaigns.studies.user_module_dependencies import find_user_modules
from shoal.scenarios import ScenarioDependencies, normalized_absolute_path

MOST_BYTES = 256 << 20


@dataclass(frozen=True)
class StudyBundle:
    """`files` are the contents by absolute path on the computer of the study, `folder` is the working folder there.

    `etc` is where the user's profiles are, `code` the folders in which modules are searched for, `modules` their
    names. `digest` covers what the digest of the scenario does not: code, messages, and files that are named.
    """

    files: Mapping[str, bytes]
    folder: str = "/"
    etc: str = "/"
    code: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    digest: str = ""

    def pack(self) -> bytes:
        """All of it as bytes: a line of JSON, and then the contents one after another."""
        sizes = [[path, len(data)] for path, data in self.files.items()]
        head = [self.folder, self.etc, self.code, self.modules, self.digest, sizes]
        return b"\n".join([json.dumps(head).encode(), b"".join(self.files.values())])

    def unpack(self, root: Path) -> "Workspace":
        """Write the files below a folder. Raises OSError, and BundleError for a path that leads out of it."""
        root = root.resolve()
        for path, data in self.files.items():
            place = rebase_path(root, path)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        rebase_path(root, self.folder).mkdir(parents=True, exist_ok=True)
        return Workspace(root, self.folder, self.etc, self.code, self.modules)


def parse_bundle(data: bytes) -> StudyBundle:
    """The bundle that `pack` has made. Raises BundleError."""
    head, _, contents = data.partition(b"\n")
    try:
        folder, etc, code, modules, digest, sizes = json.loads(head)
        ends = list(accumulate(size for _, size in sizes))
        if sum(ends[-1:]) != len(contents):  # integers
            raise ValueError
        files = {path: contents[end - size : end] for (path, size), end in zip(sizes, ends, strict=True)}
        return StudyBundle(files, folder, etc, tuple(code), tuple(modules), digest)
    except (ValueError, TypeError):
        raise BundleError("these bytes are not a bundle of a study") from None


def make_bundle(files: Iterable[Path], sources: ScenarioDependencies, named: Mapping[str, Path]) -> StudyBundle:
    """Read these files, the sources of a scenario with the modules of a user, and files that a study names.

    Raises OSError, and BundleError if they are too large.
    """
    modules = find_user_modules(sources.modules)
    content: dict[str, bytes] = {}
    total = 0
    own = [file for _, file in modules.values()]
    for path in sorted(
        {
            normalized_absolute_path(path)
            for path in (*files, *sources.files, *sources.data.values(), *named.values(), *own)
        }
    ):
        total += path.stat().st_size
        if total > MOST_BYTES:
            raise BundleError(f"the files of the study have more than {MOST_BYTES >> 20} MiB together, with {path}")
        content[str(path)] = path.read_bytes()
    parts = [(name, content[str(file)]) for name, (_, file) in modules.items()]
    parts += [
        (name, content[str(normalized_absolute_path(path))]) for name, path in sorted({**sources.data, **named}.items())
    ]
    digest = hashlib.sha256()
    for name, data in parts:
        digest.update(f"{name!r} {len(data)} ".encode() + data)
    roots = dict.fromkeys(str(root) for root, _ in modules.values())
    folder, etc = str(normalized_absolute_path(Path())), str(normalized_absolute_path(user_etc()))
    return StudyBundle(content, folder, etc, tuple(roots), tuple(modules), digest.hexdigest() if parts else "")
