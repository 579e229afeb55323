"""Numbers that know where they come from."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["Frozen", "Origin", "Quantity"]


class Frozen(BaseModel):
    """Base of everything in the model: immutable, no unknown fields, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Origin(StrEnum):
    """How a number came about."""

    MEASURED = "measured"  # fitted to the cloud or the photographs
    SHARED = "shared"  # one value for several boards, fitted together
    IMPLIED = "implied"  # follows from a contact with another board or the ground
    SNAPPED = "snapped"  # moved to a stock size within its uncertainty
    INFERRED = "inferred"  # nothing showed it; chosen so that the assembly holds
    GIVEN = "given"  # the user said so

    def __reduce_ex__(self, protocol: int) -> tuple[type[Origin], tuple[str]]:
        """Pickled by its value on every Python: 3.11.0 to 3.11.3 call `getattr`, which the cache rightly refuses."""
        return type(self), (self.value,)


class Quantity(Frozen):
    """A length in millimetres or an angle in degrees, with its standard error and origin."""

    value: float
    standard_error: float | None = Field(default=None, ge=0)
    origin: Origin = Origin.MEASURED
