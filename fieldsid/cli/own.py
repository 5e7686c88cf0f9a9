"""The user's own effects: every YAML file in `effects/` of the folder a command is run in takes part in that command."""

from __future__ import annotations

import os

OWN_EFFECTS = "effects"


def load_own_effects() -> None:
    """Make the effects of the working folder known to this process; raises EffectError naming the file and the place."""
    if not os.path.isdir(OWN_EFFECTS) or not any(n.endswith((".yaml", ".yml")) for n in os.listdir(OWN_EFFECTS)):  # noqa: PTH112, PTH208 - no import
        return
    from pathlib import Path

    from fieldsid.effects import add_effects, forget_effects
    from fieldsid.effects._user import load_user_effects

    forget_effects()
    add_effects(load_user_effects(Path(OWN_EFFECTS)).values())
