"""Where profiles and the files that they name are."""

from pathlib import Path

import pytest

from runtime.profile import resolve_root_copy


def test_a_copy_counts_instead_of_its_file_but_a_folder_in_which_files_may_lack_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, root = tmp_path / "data", tmp_path / "root"
    copies = Path(root, *folder.parts[1:])
    for place in (folder, copies):
        place.mkdir(parents=True)
        (place / "camera.yaml").touch()
    (folder / "cam0").mkdir()
    monkeypatch.setenv("SHOAL_ROOT", str(root))
    assert resolve_root_copy(folder / "camera.yaml") == copies / "camera.yaml"
    assert resolve_root_copy(folder) == folder
    assert resolve_root_copy(folder / "cam0") == folder / "cam0"
    (folder / "camera.yaml").unlink()
    (folder / "cam0").rmdir()
    folder.rmdir()
    assert resolve_root_copy(folder) == copies  # of another computer
