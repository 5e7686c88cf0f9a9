"""The definition that a model keeps of an effect that is not built in, so that the model can be used in another folder.

A user's effect in YAML is data: the model keeps the text and reads it as it would read the file. An effect in Python is code
of an installed package, and code is never executed from a data file: the model keeps the names of the package and the file and
the file's SHA-256, and where that package is not installed the error says what to install.
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
    """The file that defined an effect, its YAML text and the SHA-256 of that text.

    An effect in Python has no text: `package` names its distribution and entry point, and the SHA-256 is that of the file.
    """

    file: str
    sha256: str
    text: str = ""
    package: str = ""

    @property
    def is_code(self) -> bool:
        """Whether the effect is Python code of a package, of which the model keeps no text."""
        return not self.text

    @property
    def place(self) -> str:
        """Where the effect is defined, in words."""
        return f"{self.file} ({self.package})" if self.package else self.file


def of_text(text: str, file: Path) -> Definition:
    """Return the definition of an effect that a file defines by its YAML text."""
    return Definition(str(file.absolute()), _digest(text), text)


def definitions_body(own: Mapping[str, Definition]) -> list[dict[str, Any]]:
    """Return definitions, given by the effect's name, as entries of a model's file; `read_definitions` reads them back."""
    return [
        {"name": name, "file": d.file, "sha256": d.sha256, **({"package": d.package} if d.is_code else {"text": block(d.text)})}
        for name, d in own.items()
    ]


def read_definitions(body: Sequence[Mapping[str, Any]], path: Path) -> dict[str, Definition]:
    """Return the definitions of the entries of a model's file, by the effect's name.

    Raises ArtifactError where the SHA-256 of a text is not the one that was written with it.
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
