"""MuJoCo itself, imported when it is first needed."""

from collections import deque
from typing import Any

from ...core.errors import BrokenPluginError

#: What MuJoCo warned of last; the reason given when a rollout fails.
WARNINGS: deque[str] = deque(maxlen=1)


def engine() -> Any:
    """The module ``mujoco``.

    Raises:
        BrokenPluginError: it is not installed.
    """
    try:
        import mujoco
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise BrokenPluginError(
            "simulator 'mujoco' needs the MuJoCo engine; install it with: pip install 'muslin[mujoco]'"
        ) from error
    if mujoco.get_mju_user_warning() is None:
        # Otherwise MuJoCo prints them and drops a MUJOCO_LOG.TXT into the user's folder.
        mujoco.set_mju_user_warning(WARNINGS.append)
    return mujoco
