"""What a model keeps of an effect that is not built in, so that it can be used, or at least found, in another folder.

A user's effect in YAML is data: its text is kept in the model, and read back as the file was. An effect in Python is code of
an installed package, and code is never taken out of a data file: the model keeps the package, the file and its SHA-256, and
where no such package is installed the error says what to install.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fieldsid.artifacts import block
from fieldsid.errors import ArtifactError

NONE: Mapping[str, Definition] = MappingProxyType({})
"""The definitions of a model whose effects are all built in."""


@dataclass(frozen=True, slots=True)
class Definition:
    """Where an effect lived and what it was: its file, and the YAML text with that text's SHA-256.

    Of code there is no text: `package` says which distribution and entry point it came by, and the SHA-256 is the file's.
    """

    file: str
    sha256: str
    text: str = ""
    package: str = ""

    @property
    def is_code(self) -> bool:
        """Whether the effect is code of a package, which the model does not hold."""
        return not self.text

    @property
    def place(self) -> str:
        """Where the effect lived, in words."""
        return f"{self.file} ({self.package})" if self.package else self.file


def of_text(text: str, file: Path) -> Definition:
    """Return the definition of an effect by the YAML text of a file."""
    return Definition(str(file.absolute()), _digest(text), text)


def definitions_body(own: Mapping[str, Definition]) -> list[dict[str, Any]]:
    """Return definitions by the effect's name as a model's file holds them; `read_definitions` reads them back."""
    return [
        {"name": name, "file": d.file, "sha256": d.sha256, **({"package": d.package} if d.is_code else {"text": block(d.text)})}
        for name, d in own.items()
    ]


def read_definitions(body: Sequence[Mapping[str, Any]], path: Path) -> dict[str, Definition]:
    """Return the definitions that a model's file holds, by the effect's name.

    Raises ArtifactError where a text is not the one that was written. The body has the shape that a model's file has.
    """
    found = {}
    for entry in body:
        name, text = entry["name"], entry.get("text", "")
        found[name] = Definition(entry["file"], entry["sha256"], text, entry.get("package", ""))
        if text and _digest(text) != entry["sha256"]:
            raise ArtifactError(
                f"`{path}`: the definition of effect `{name}` is not the one that the model was made with",
                found=f"SHA-256 {_digest(text)}, it was {entry['sha256']}",
                hint=f"put the text under `own_effects` back as it was, or identify again with `--effects {name}`",
            )
    return found


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8")).hexdigest()
