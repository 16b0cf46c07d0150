"""Values of a mission file: TOML's own types and nothing else, so a quoted number or a `true` is a slip, not a number."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, Literal, TypeVar

from numpy.typing import ArrayLike
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    create_model,
    model_validator,
)

from gammastar import checks
from gammastar.errors import InputError, UnknownNameError
from gammastar.mission.complaint import LONGEST_SHOWN, SectionError, UnknownKeyError, shown

LARGEST_INTEGER = 2**63 - 1  # of TOML


class Section(BaseModel):
    """A table of a mission file; it knows its keys and refuses every other one with a suggestion."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            raise SectionError(f"must be a table of keys (got {shown(values)}); write it as a section")
        for key in values:
            if key not in cls.model_fields:
                raise UnknownKeyError(key, cls.model_fields)
        return values


class Construction(Section):
    """A table whose keys are the arguments of a function or class; made by `section_of`."""

    @classmethod
    def factory(cls) -> Callable[..., Any]:
        """Return what the arguments are for."""
        raise AssertionError("section_of overrides this")

    def arguments(self) -> dict[str, Any]:
        """Return the arguments by name, defaults included."""
        parameters = inspect.signature(self.factory()).parameters
        return {name: getattr(self, name) for name in parameters}


Kind = TypeVar("Kind", bound=Construction)


def section_of(
    factory: Callable[..., Any],
    base: type[Kind],
    types: Mapping[str, Any] | None = None,
    optional: bool = False,
    **tag: str,
) -> type[Kind]:
    """Return the section whose keys, types and defaults are those of a function's or class's own signature.

    Args:
        factory: Its parameters must be annotated with numbers, truth values, strings, literals, `ArrayLike`, or formulas.
        base: Section that it becomes one of, with its keys beside.
        types: Of parameters that are none of these.
        optional: Whether all may be left out, and are None then: for changes of something that has them all.
        tag: One more key and its value, by which the section is chosen from several.
    """
    fields: dict[str, Any] = {key: (str, value) for key, value in tag.items()}
    for name, parameter in inspect.signature(factory, eval_str=True).parameters.items():
        if name in tag:
            continue
        default = ... if parameter.default is parameter.empty else parameter.default
        kind = (types or {}).get(name) or _value_type(parameter.annotation)
        fields[name] = (kind | None, None) if optional else (kind, Field(default, validate_default=True))

    class Arguments(base):  # type: ignore[misc, valid-type]
        @classmethod
        def factory(cls) -> Callable[..., Any]:
            return factory

    return create_model(f"{factory.__name__}_section", __base__=Arguments, **fields)


def choose(values: Any, key: str, sections: Mapping[str, type[Kind]]) -> Kind:
    """Return the section that a table asks for by the value of one key."""
    if isinstance(values, Construction):
        return values  # type: ignore[return-value]
    if not isinstance(values, Mapping) or key not in values:
        got = "no table" if not isinstance(values, Mapping) else "none"
        raise SectionError(f'must have the key "{key}", one of {", ".join(sorted(sections))} (got {got}); add it')
    if not isinstance(values[key], str) or values[key] not in sections:
        raise SectionError(str(_unknown(key, values[key], sections)))
    return sections[values[key]].model_validate(values)


def default_of(function: Callable[..., Any], name: str) -> Any:
    """Return the default of a function's parameter, so that a mission's default is written once."""
    return inspect.signature(function).parameters[name].default


def _number(value: Any, info: ValidationInfo) -> float:
    return checks.number(_plain_number(value, f"{info.field_name} must be a number"), str(info.field_name))


def _positive(value: Any, info: ValidationInfo) -> float:
    return checks.number(_number(value, info), str(info.field_name), above=0)


def _not_negative(value: Any, info: ValidationInfo) -> float:
    return checks.number(_number(value, info), str(info.field_name), at_least=0)


def _integer(value: Any, info: ValidationInfo) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(
            f"{info.field_name} must be a whole number (got {shown(value)}); write it without a point or quotes"
        )
    if not -LARGEST_INTEGER <= value <= LARGEST_INTEGER:
        raise InputError(f"{info.field_name} must be at most {LARGEST_INTEGER} (got {shown(value)}); lower it")
    return value


def _count(value: Any, info: ValidationInfo) -> int:
    if _integer(value, info) < 0:
        raise InputError(f"{info.field_name} must be a whole number from 0 (got {value}); drop the sign")
    return int(value)


def _text(value: Any, info: ValidationInfo) -> str:
    if not isinstance(value, str):
        raise InputError(f"{info.field_name} must be text (got {shown(value)}); put it in quotes")
    return value


def _flag(value: Any, info: ValidationInfo) -> bool:
    if not isinstance(value, bool):
        raise InputError(
            f"{info.field_name} must be true or false (got {shown(value)}); write one of them, without quotes"
        )
    return value


def _formula(value: Any, info: ValidationInfo) -> float | str:
    if isinstance(value, str):
        return value
    expected = f"{info.field_name} must be a formula in quotes, or a number"
    return checks.number(_plain_number(value, expected), str(info.field_name))


def _formulas(value: Any, info: ValidationInfo) -> Any:
    if not isinstance(value, (list, tuple)):
        raise InputError(
            f"{info.field_name} must be a list of numbers or formulas (got {shown(value)}); put it in brackets"
        )
    return tuple(_formula(item, info) for item in value)


def _formula_table(value: Any, info: ValidationInfo) -> Any:
    if not isinstance(value, Mapping):
        raise InputError(
            f"{info.field_name} must be a table of names with values (got {shown(value)}); write it as one"
        )
    return {name: _formula(item, info) for name, item in value.items()}


def _tables(value: Any, info: ValidationInfo) -> Any:
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{info.field_name} must be a list of tables (got {shown(value)}); put it in brackets")
    return list(value)


def _rows(value: Any, info: ValidationInfo) -> Any:
    """Return points as tuples; where one is no point the message says which."""
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{info.field_name} must be a list of points (got {shown(value)}); write [[x, y, z], ...]")
    for k, row in enumerate(value):
        if not isinstance(row, (list, tuple)) or len(row) != 3:
            raise InputError(f"{info.field_name}[{k}] must be three numbers (got {shown(row)}); write [x, y, z]")
    return nested(value, info, depth=2)


def _array(value: Any, info: ValidationInfo) -> Any:
    return nested(value, info, depth=2)


def _vector(value: Any, info: ValidationInfo) -> Any:
    return tuple(checks.array(nested(value, info, depth=1), str(info.field_name), (3,)).tolist())


def nested(value: Any, info: ValidationInfo, depth: int) -> Any:
    """Return a number, or a list of numbers, or lists of them down to a depth, as tuples."""
    if isinstance(value, (list, tuple)) and depth:
        return tuple(nested(item, info, depth - 1) for item in value)
    return checks.number(_plain_number(value, f"{info.field_name} must hold numbers only"), f"{info.field_name}")


def _plain_number(value: Any, expected: str) -> float:
    """Return a number as a float; booleans, texts, dates and tables are none, whatever Python makes of them."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{expected} (got {shown(value)}); write plain numbers, without quotes")
    try:
        return float(value)
    except OverflowError as error:
        raise InputError(f"{expected} (got one beyond the range of floats); lower it") from error


def one_of(known: Collection[str]) -> PlainValidator:
    """Return the validator of a text that is one of the known names."""

    def check(value: Any, info: ValidationInfo) -> str:
        if not isinstance(value, str) or value not in known:
            raise _unknown(str(info.field_name), value, known)
        return value

    return PlainValidator(check)


def _unknown(name: str, value: Any, known: Collection[str]) -> InputError:
    """Return the complaint about a value that is not among the known names."""
    if isinstance(value, str):
        return UnknownNameError(name, value[:LONGEST_SHOWN], known)
    return InputError(f"{name} must be one of {', '.join(sorted(known))} (got {shown(value)}); choose one of them")


Number = Annotated[float, PlainValidator(_number)]
Positive = Annotated[float, PlainValidator(_positive)]
NotNegative = Annotated[float, PlainValidator(_not_negative)]
Integer = Annotated[int, PlainValidator(_integer)]
Count = Annotated[int, PlainValidator(_count)]
Text = Annotated[str, PlainValidator(_text)]
Flag = Annotated[bool, PlainValidator(_flag)]
Formula = Annotated[Any, PlainValidator(_formula)]  # text, or a number
Formulas = Annotated[Any, PlainValidator(_formulas)]  # a list of them
FormulaTable = Annotated[Any, PlainValidator(_formula_table)]  # names with them
Tables = BeforeValidator(_tables)  # of a list of sections
Rows = Annotated[Any, PlainValidator(_rows)]  # (n, 3)
Array = Annotated[Any, PlainValidator(_array)]  # a number, a list of numbers, or a list of rows
Vector = Annotated[Any, PlainValidator(_vector)]  # (3,)


def _value_type(hint: Any) -> Any:
    """Return the type of value in TOML that an annotation of a signature stands for."""
    if typing.get_origin(hint) is Literal:
        return Annotated[str, one_of(typing.get_args(hint))]
    types: list[tuple[Any, Any]] = [(float, Number), (int, Integer), (str, Text), (bool, Flag), (ArrayLike, Array)]
    types += [(float | None, Number | None), (float | str, Formula), (float | str | None, Formula | None)]
    types += [(ArrayLike | tuple[float | str, float | str], Formulas)]
    types += [(ArrayLike | tuple[float | str, float | str] | None, Formulas | None)]
    types += [(ArrayLike | tuple[float | str, float | str, float | str], Formulas)]
    types += [(Mapping[str, float | str] | None, FormulaTable | None)]
    return next(kind for annotation, kind in types if annotation == hint)
