"""The exception that photocoag raises."""

from __future__ import annotations


class ConfigError(ValueError):
    """Bad input: a configuration, a model file, an argument, a folder.

    Attributes
    ----------
    where : str
        Origin of the value: file, file and line, or override; may be empty.
    key : str
        Full name with its unit, such as ``"control.power_max_W"``; may be empty.
    problem : str
        Description of what is wrong; may be empty.
    found : str
        The value found, as written.
    accepted : str
        Accepted values, with the unit.

    Examples
    --------
    >>> import photocoag as pc
    >>> try:
    ...     pc.Config().set("control.horizon", 1)
    ... except pc.ConfigError as error:
    ...     print(error.key, "|", error.found, "|", error.accepted)
    control.horizon | 1 | an integer from 2 to 50
    """

    def __init__(
        self,
        message: str,
        where: str = "",
        key: str = "",
        problem: str = "",
        found: str = "",
        accepted: str = "",
    ) -> None:
        super().__init__(message)
        self.where = where
        self.key = key
        self.problem = problem
        self.found = found
        self.accepted = accepted

    def __reduce__(self) -> tuple[object, ...]:
        parts = (str(self), self.where, self.key, self.problem, self.found, self.accepted)
        return type(self), parts


def refuse(key: str, found: object, accepted: str) -> ConfigError:
    """The error for an invalid argument."""
    text = repr(found)
    text = text if len(text) <= 80 else text[:77] + "..."
    return ConfigError(
        f"{key}: found {text}; accepted: {accepted}", key=key, found=text, accepted=accepted
    )
