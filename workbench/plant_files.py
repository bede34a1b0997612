"""Plants by name: those of the project's list, and a user's own as ``file.py:function``.

The file is Python: it builds a :class:`workbench.plant.Plant` of the same parts and effects, and
of effect classes of its own.  It runs as any program of the user does.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from workbench.conditions import UnknownQuantityError
from workbench.effect import Effect
from workbench.errors import InputError, Message, listed, nearest
from workbench.plant import Plant
from workbench.plant_checks import check_plant
from workbench.plants import PLANTS


def plant_named(name: str, folder: Path | None = None) -> Plant:
    """The plant of a name in the list, or of ``file.py:function``, the file seen from ``folder``.

    Raises
    ------
    InputError
        If there is no such plant, file or function, or the function gives no plant that works.
    """
    file, colon, function = name.rpartition(":")
    if name in PLANTS:
        return PLANTS[name]()
    if not colon or not file.endswith(".py"):
        what = "there is no such plant" if name else "a rig file names its plant"
        expected = f"one of {listed(PLANTS)}, or your own as file.py:function"
        raise InputError(Message(what, name, expected, nearest(name, PLANTS)))
    path = ((folder or Path()) / file).resolve()
    if not path.is_file():
        near = nearest(path.name, (p.name for p in path.parent.glob("*.py")))
        raise InputError(Message("there is no such file", name, nearest=near))
    with _blamed(path, name):
        return replace(_built(_loaded(path), function), origin=f"{path}:{function}")


def as_it_came(plant: Plant) -> Plant:
    """The plant as its name gives it, before anybody set a value."""
    return plant_named(plant.origin or plant.name)


def plant_text(plant: Plant, folder: Path | None = None) -> str:
    """What a file in ``folder`` calls a plant."""
    if not plant.origin:
        return plant.name
    path, _, function = plant.origin.rpartition(":")
    try:
        return f"{Path(os.path.relpath(path, folder or Path())).as_posix()}:{function}"
    except ValueError:  # another drive
        return plant.origin


def _built(module: ModuleType, function: str) -> Plant:
    """What a function of a user's file builds, seen to work."""
    builder: Callable[[], Plant] | None = getattr(module, function, None)
    if not callable(builder):
        known = [
            n for n, v in vars(module).items() if callable(v) and v.__module__ == module.__name__
        ]
        what = f"{Path(module.__file__ or '').name} has no such function"
        near = nearest(function, known)
        raise InputError(Message(what, function, f"one of {listed(known)}", near))
    plant = builder()
    if not isinstance(plant, Plant):
        kind = type(plant).__name__
        raise InputError(Message(f"gives a {kind}", f"{function}()", "a workbench.plant.Plant"))
    names = [member.name for member in plant.members]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(Message(f"{listed(twice)} stands twice in it", f"{function}()"))
    check_plant(plant)  # what does not fit together shows here, not in the middle of a run
    return plant


def _loaded(path: Path) -> ModuleType:
    """The module of a file; a file that has not changed is run once."""
    text = path.read_bytes()
    name = f"own_plant_{sha256(str(path).encode() + text).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None:
        raise InputError(Message("cannot be read as Python", str(path)))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up there
    sys.path.insert(0, str(path.parent))  # for the modules beside it
    try:
        # Not by the loader: it takes bytecode of a file that was as long, within the same second.
        exec(compile(text, str(path), "exec"), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(path.parent))
    return module


@contextmanager
def _blamed(path: Path, name: str) -> Iterator[None]:
    """Errors of a user's file as messages with the name of the plant, and the line if there is one.

    What the file itself is not seen to do is put down to the member that was asked.
    """
    try:
        yield
    except UnknownQuantityError as error:
        raise InputError(_placed(error.message, name, _where(error, path))) from error
    except InputError as error:
        where = _where(error, path)
        raise InputError(*(_placed(each, name, where) for each in error.messages)) from error
    except SyntaxError as error:
        what = f"{error.msg}, in line {error.lineno} of {Path(error.filename or path).name}"
        raise InputError(Message(what, name)) from error
    except Exception as error:
        what = f"{type(error).__name__}: {error}{_called(error, path)}{_where(error, path)}"
        raise InputError(Message(what, name, nearest=_meant(error))) from error


def _placed(message: Message, name: str, where: str) -> Message:
    """A message as one about the plant, where it does not say what it is about."""
    if message.name or message.file:
        return message
    said, comma, there = message.what.partition("; ")
    return replace(message, name=name, what=said + where + comma + there)


def _meant(error: Exception) -> str:
    """The attribute that looks most like one that is not there."""
    if not isinstance(error, AttributeError) or not error.name:
        return ""
    return nearest(error.name, dir(error.obj))


def _called(error: Exception, path: Path) -> str:
    """The function of ours that a user's line calls and that fails; none where the line does."""
    *before, last = traceback.extract_tb(error.__traceback__)
    calls = any(frame.filename == str(path) for frame in before)
    ours = last.filename != str(path) and last.name.isidentifier() and last.name[0] != "_"
    return f" in {last.name}()" if calls and ours else ""


def _where(error: BaseException, path: Path) -> str:
    """The last line of a user's file on the way to an error, else the member that was asked."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    if lines:
        return f", in line {lines[-1]} of {path.name}"
    seen = [frame.f_locals for frame, _ in traceback.walk_tb(error.__traceback__)]
    asked = [each.get(key) for each in seen for key in ("member", "self")]
    members = [each.name for each in asked if isinstance(each, Effect)]
    return f", asked by {members[-1]}" if members else ""
