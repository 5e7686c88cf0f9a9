"""Files are written whole or not at all, and who cannot write them is told why."""

from __future__ import annotations

import errno

import pytest

from fieldsid.artifacts import replacing
from fieldsid.errors import ArtifactError


def write(path, number):
    """Write half of a file, until the system says that it cannot."""
    with replacing(path, force=True) as temporary:
        temporary.write_text("half of it")
        raise OSError(number, "no")


@pytest.mark.parametrize(
    ("number", "says"), [(errno.ENOSPC, "make room"), (errno.EDQUOT, "make room"), (errno.EACCES, "name a place")]
)
def test_a_full_disk_leaves_the_file_as_it_was_and_asks_for_room(tmp_path, number, says):
    path = tmp_path / "gains.yaml"
    path.write_text("as it was")
    with pytest.raises(ArtifactError, match="cannot be written") as caught:
        write(path, number)
    assert caught.value.hint.startswith(says)
    assert path.read_text() == "as it was"
    assert [p.name for p in tmp_path.iterdir()] == ["gains.yaml"]
