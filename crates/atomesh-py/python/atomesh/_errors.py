"""What atomesh raises, and warns of."""


class Error(Exception):
    """All that atomesh raises, but for `TypeError` of keywords and types."""


class InputError(Error, ValueError):
    """An option out of its range, or an image or mesh that is of no use."""


class FileError(Error, OSError):
    """A file that cannot be read or written: `filename`, and `errno` where the system refused it."""

    def __str__(self) -> str:
        # OSError's own words would be for system calls
        return str(self.args[0]) if len(self.args) == 1 else super().__str__()


class MemoryForecastError(Error, MemoryError):
    """Work that would not fit into memory; nothing was allocated for it."""


class Cancelled(Error):
    """The caller's `progress` said so."""


class AtomeshWarning(UserWarning):
    """The result may not be what was wanted."""


class AtomeshNote(AtomeshWarning):
    """Something was changed, guessed, filled, left out or not met."""


for _class in (Error, InputError, FileError, MemoryForecastError, Cancelled, AtomeshWarning, AtomeshNote):
    _class.__module__ = "atomesh"
