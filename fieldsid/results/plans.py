"""What `sysid plan` comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fieldsid.planning.design.plan import Plan
from fieldsid.planning.discriminate.discriminate import Separation
from fieldsid.records.keys import INLINE, Key, Result


@dataclass(frozen=True, slots=True)
class Planned(Result):
    """What to fly."""

    SCHEMA = "fieldsid/plan/1"

    plan: Annotated[Plan, INLINE]
    files: Annotated[tuple[str, ...], Key("The files that were written.")]
    separation: Annotated[Separation | None, Key("What tells the effects apart, where that was asked.", is_optional=True)] = None
    separations: Annotated[tuple[Separation, ...] | None, Key("The same for every speed.", is_optional=True)] = None
    says: Annotated[tuple[str, ...] | None, Key("The same in sentences.", is_optional=True)] = None
