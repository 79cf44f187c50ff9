"""How a command ends when it does not simply end: one line on the error stream, and an exit code that scripts know."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from studies.errors import escaped

DONE, BAD, REFUSED = 0, 1, 2
LONGEST = 400  # characters of a message
AGAIN = 0.05  # s
BY_SIGNAL = 128  # exit code of a program that a signal ended, above the signal's number
RESUME = {
    "study": "the same command goes on where it stopped",
    "sweep": "the same command with --resume goes on where it stopped",
}
WHOLE = "what is written is whole, what was under way is discarded"
NO_SPACE, NOT_ALLOWED = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG), (errno.EACCES, errno.EPERM, errno.EROFS)
REMEDIES = {
    **dict.fromkeys(NO_SPACE, "free space or choose another disk"),
    **dict.fromkeys(NOT_ALLOWED, "choose another folder, or ask for the right to use this one"),
    **dict.fromkeys((errno.EMFILE, errno.ENFILE), "close other programs or raise the limit (ulimit -n)"),
    errno.ENOMEM: "free memory, or use fewer --workers",
    errno.ENOENT: "check the path",
    errno.EISDIR: "name a file",
    errno.ENOTDIR: "one of the folders in this path is a file",
    errno.ENAMETOOLONG: "choose a shorter name",
}


class Terminated(KeyboardInterrupt):
    """SIGTERM: like an interrupt it passes every `except Exception`, and every `finally` ends its workers and files."""


def run(command: str, work: Callable[[], int]) -> int:
    """The exit code of a command; whatever stops it is said in one line.

    Bad input and files that cannot be read or written: 2. An interrupt: 130, a request to end: 143. A reader that has gone
    (`gainsmith list | head`) is nobody's fault: 0.
    """
    from estimators.errors import GainsmithError

    try:
        with _ended_by_signals():
            code = work()
            sys.stdout.flush()
    except GainsmithError as error:
        return refuse(str(error))
    except BrokenPipeError:
        _forget_output()
        return DONE
    except OSError as error:
        return refuse(_words(error))
    except KeyboardInterrupt as error:
        number = signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT
        word = "terminated" if isinstance(error, Terminated) else "interrupted"
        _say(f"{word}; {RESUME.get(command, WHOLE)}")
        return BY_SIGNAL + number
    return code


def refuse(message: str) -> int:
    """Say it on the error stream, on one line of printable characters, and return the exit code of bad input."""
    _say(message)
    return REFUSED


def one_line(text: str, most: int = LONGEST) -> str:
    """Control characters escaped; of what is too long the middle is left out, for the remedy stands at the end."""
    shown = text[: most + 1] if len(text) <= most else text[: 2 * most] + text[-2 * most :]
    clean = escaped(shown)
    if len(text) <= most and len(clean) <= most:
        return clean
    tail = 3 * most // 5  # a command to be copied is whole
    return f"{clean[: most - tail - 5]} ... {clean[-tail:]}"


def speak_safely() -> None:
    """A terminal without Unicode shows an escape instead of stopping the program; a closed output (`>&-`) is no output."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - for as long as the program runs
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, ValueError):  # a stream that is no file
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """SIGINT raises KeyboardInterrupt and SIGTERM `Terminated`, for certain; signals belong to the main thread.

    Python swallows what is raised in a callback, such as those around a fork: it is then raised again a little later.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    last = [signal.SIGINT]

    def ended(number: int, _frame: FrameType | None) -> None:
        if number != signal.SIGALRM:
            last[0] = signal.Signals(number)
        raise Terminated if last[0] == signal.SIGTERM else KeyboardInterrupt

    def swallowed(what: sys.UnraisableHookArgs) -> None:
        if isinstance(what.exc_value, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
        else:
            hook(what)

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)
    before = [signal.signal(number, ended) for number in numbers]
    hook, sys.unraisablehook = sys.unraisablehook, swallowed
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = hook
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _words(error: OSError) -> str:
    place = error.filename if isinstance(error.filename, str) and error.filename else "output"
    remedy = REMEDIES.get(error.errno or 0, "check the path, the disk and the rights of its folder")
    return f"{place}: {error.strerror or error}; {remedy}"


def _say(message: str) -> None:
    with suppress(OSError):  # nobody listens
        print(f"gainsmith: {one_line(message)}", file=sys.stderr, flush=True)


def _forget_output() -> None:
    """Python would complain once more when it flushes the closed stream at its end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
