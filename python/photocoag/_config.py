"""Configurations: the same keys, units and checks as the program's TOML files."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Iterator, Mapping
from typing import Any

from . import _core
from ._errors import ConfigError, refuse


_Core = _core.Config  # inside class Config, `_core` names the attribute


def _is_number(value: object) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _toml_text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04X}" for c in escaped) + '"'


def _toml_key(key: str) -> str:
    plain = key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if plain else _toml_text(key)


def toml_value(key: str, value: object) -> str:
    """`value` as TOML on one line."""
    accepted = "a number, text, a boolean, or a list or mapping of these"
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
        value = value.item()
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        if not -(2**63) <= int(value) < 2**63:
            raise refuse(key, value, "an integer of 64 bits")
        return str(int(value))
    if _is_number(value):
        number = float(value)  # type: ignore[arg-type]
        if math.isnan(number):
            return "nan"
        if math.isinf(number):
            return "inf" if number > 0 else "-inf"
        return repr(number)
    if isinstance(value, (str, os.PathLike)):
        text = os.fspath(value)
        if not isinstance(text, str) or not text.isprintable() and any(c < " " for c in text):
            raise refuse(key, value, "text without control characters")
        try:
            text.encode()
        except UnicodeEncodeError:
            raise refuse(key, value, "text in Unicode") from None
        return _toml_text(text)
    if isinstance(value, Mapping):
        for name in value:
            if not isinstance(name, str) or not name.isprintable() or not name:
                raise refuse(key, name, "the name of a key")
        pairs = (f"{_toml_key(k)} = {toml_value(f'{key}.{k}', v)}" for k, v in value.items())
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(key, one) for one in value) + "]"
    raise refuse(key, value, accepted)


def toml_document(tables: Mapping[str, object]) -> str:
    """A mapping of sections as a TOML document: plain values first, then tables."""
    lines: list[str] = []

    def write(path: tuple[str, ...], table: Mapping[str, object]) -> None:
        for key, value in table.items():
            if not isinstance(key, str) or not key.isprintable() or not key:
                raise refuse("key", key, "the name of a key")
            if not isinstance(value, Mapping):
                lines.append(f"{_toml_key(key)} = {toml_value('.'.join((*path, key)), value)}")
        for key, value in table.items():
            if isinstance(value, Mapping):
                lines.append(f"[{'.'.join(_toml_key(part) for part in (*path, key))}]")
                write((*path, key), value)

    write((), tables)
    return "\n".join(lines) + "\n"


class Section(Mapping[str, Any]):
    """One table of a configuration, read only: attributes and items are its keys.

    Examples
    --------
    >>> import photocoag as pc
    >>> pc.Config().control.horizon
    5
    """

    __slots__ = ("_name", "_values")

    def __init__(self, name: str, values: Mapping[str, Any]) -> None:
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_values", dict(values))

    def __getitem__(self, key: str) -> Any:
        try:
            value = self._values[key]
        except KeyError:
            raise KeyError(f"{self._name}.{key}") from None
        return Section(f"{self._name}.{key}", value) if isinstance(value, dict) else value

    def __getattr__(self, key: str) -> Any:
        if key.startswith("__"):
            raise AttributeError(key)
        try:
            return self[key]
        except KeyError:
            raise AttributeError(
                f"no key {self._name}.{key}; there are: {', '.join(self._values)}"
            ) from None

    def __setattr__(self, key: str, value: object) -> None:
        raise AttributeError(f'configurations do not change: config = config.set("{self._name}.{key}", ...)')

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        return f"{self._name}: {self._values!r}"

    def __reduce__(self) -> tuple[object, ...]:
        return Section, (self._name, self._values)


class Config:
    """A complete, validated configuration; it never changes.

    ``Config()`` is the paper's 1 kHz case: every key at its default. Keys, units, ranges and
    messages are those of the program (``./photocoag config`` prints them all).

    Raises
    ------
    ConfigError
        Unknown key, wrong type or a value out of range, with `key`, `found` and `accepted`.

    Examples
    --------
    >>> import photocoag as pc
    >>> config = pc.Config().set("plant.absorption_factor", 0.5).set("control.horizon", 10)
    >>> config.plant.absorption_factor, config["control.horizon"]
    (0.5, 10)
    """

    __slots__ = ("_core", "_values")

    _core: _Core
    _values: dict[str, Any] | None

    def __init__(self) -> None:
        self._core = _core.Config()
        self._values = None

    @classmethod
    def _of(cls, core: _Core) -> Config:
        config = cls.__new__(cls)
        config._core = core
        config._values = None
        return config

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Config:
        """Read a TOML file.

        Parameters
        ----------
        path : str or path
            A configuration, or the ``config.toml`` of a run folder.
        """
        file = os.fspath(path)
        if not isinstance(file, str) or "\0" in file:
            raise refuse("path", path, "the name of a TOML file")
        text = _core.read_config_text(file)
        folder = os.path.dirname(os.path.abspath(file))
        return cls._of(_core.Config(text, file, folder, []))

    @classmethod
    def from_toml(cls, text: str) -> Config:
        """Read TOML text, such as the result of `to_toml`."""
        if not isinstance(text, str):
            raise refuse("text", text, "TOML text")
        try:
            text.encode()
        except UnicodeEncodeError:
            raise refuse("text", text, "text in Unicode") from None
        return cls._of(_core.Config(text, "TOML text", os.getcwd(), []))

    @classmethod
    def from_dict(cls, values: Mapping[str, object]) -> Config:
        """Read nested mappings, such as the result of `to_dict`; missing keys take defaults."""
        if not isinstance(values, Mapping):
            raise refuse("values", values, "a mapping of sections")
        return cls.from_toml(toml_document(values))

    def set(self, key: str, value: object) -> Config:
        """A new configuration with one value changed.

        Parameters
        ----------
        key : str
            Full key with its unit; layers by name: ``"tissue.layers.RPE.thickness_um"``.
        value : float, int, str, bool, list or dict
            In the key's unit.
        """
        if not isinstance(key, str) or not key or not key.isprintable() or "=" in key:
            raise refuse("key", key, 'a full key, such as "control.horizon"')
        return self._changed([f"{key}={toml_value(key, value)}"])

    def update(self, values: Mapping[str, object]) -> Config:
        """A new configuration with several values changed, by full key."""
        if not isinstance(values, Mapping):
            raise refuse("values", values, "a mapping of full keys")
        for key in values:
            if not isinstance(key, str) or not key or not key.isprintable() or "=" in key:
                raise refuse("key", key, 'a full key, such as "control.horizon"')
        return self._changed([f"{k}={toml_value(k, v)}" for k, v in values.items()])

    def _changed(self, options: list[str]) -> Config:
        try:
            folder = os.getcwd()
            return Config._of(self._core.with_overrides([(one, folder) for one in options]))
        except ConfigError as error:
            where = error.where.removeprefix("--set ")
            raise ConfigError(
                str(error).replace("--set ", ""),
                where, error.key, error.problem, error.found, error.accepted,
            ) from None

    def to_dict(self) -> dict[str, Any]:
        """Every key, as nested dictionaries in the units of the keys."""
        return self._core.to_dict()

    def to_toml(self) -> str:
        """The complete, annotated TOML text."""
        return self._core.to_toml()

    @property
    def sha256(self) -> str:
        """SHA-256 of `to_toml`, as in ``summary.json``."""
        return self._core.sha256()

    @property
    def cycles(self) -> int:
        """Control cycles of a run."""
        return self._core.cycles

    def _all(self) -> dict[str, Any]:
        if self._values is None:
            self._values = self.to_dict()
        return self._values

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        values = self._all()
        if name not in values:
            raise AttributeError(f"no section {name}; there are: {', '.join(values)}")
        value = values[name]
        return Section(name, value) if isinstance(value, dict) else value

    def __getitem__(self, key: str) -> Any:
        value: Any = self._all()
        for part in key.split("."):
            if isinstance(value, list):
                value = next((one for one in value if one.get("name") == part), None)
            elif isinstance(value, dict) and part in value:
                value = value[part]
            else:
                value = None
            if value is None:
                raise KeyError(key)
        return Section(key, value) if isinstance(value, dict) else value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._all()]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Config) and self._core == other._core

    def __hash__(self) -> int:
        return hash(self.sha256)

    def __reduce__(self) -> tuple[object, ...]:
        return _restore, self._core.state()

    def __repr__(self) -> str:
        control, plant = self.control, self.plant
        return (
            f"Config({control.peak_reference_K:g} K, limit {control.peak_max_K:g} K, period "
            f"{control.period_ms:g} ms, horizon {control.horizon}, eye {plant.model} with "
            f"absorption factor {plant.absorption_factor:g})"
        )

    def _repr_html_(self) -> str:
        from html import escape

        return f"<details><summary>{escape(repr(self))}</summary><pre>{escape(self.to_toml())}</pre></details>"


def _restore(text: str, name: str, folder: str, overrides: list[tuple[str, str]]) -> Config:
    return Config._of(_core.Config(text, name, folder, overrides))
