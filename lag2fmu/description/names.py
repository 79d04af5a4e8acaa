"""Names: which ones lag2fmu generates from the user's."""

from __future__ import annotations

_MASSLESS = "massless_"

DAMPER_RATE = "rate"
"""What the force of a damper calls the damper's own rate."""

SETTINGS = ("solver_tolerance", "solver_step", "solver_max_step")
INVERSE = "_inverse"
"""What stands behind the name of a mechanism whose motion is given."""
OBSERVER = "_observer"
"""What stands behind the name of a mechanism that is observed."""
ENERGIES = ("kinetic_energy", "potential_energy", "total_energy", "generalized_energy")


def velocity(name: str) -> str:
    """Name of the first time derivative of a coordinate or motion input."""
    return f"{name}_dot"


def acceleration(name: str) -> str:
    """Name of the second time derivative of a coordinate or motion input."""
    return f"{name}_ddot"


def of_coordinate(name: str) -> dict[str, str]:
    """{generated name: what it is} of all names that the coordinate ``name`` brings."""
    return {
        velocity(name): "velocity",
        acceleration(name): "acceleration",
        generalized_force(name): "external force",
        momentum(name): "momentum",
        derivative(name): "derivative",
        derivative(velocity(name)): "derivative of the velocity",
    }


def of_constraint(name: str) -> dict[str, str]:
    """{generated name: what it is} of all names that the constraint ``name`` brings."""
    return {multiplier(name): "multiplier", residual(name): "residual"}


def of_unilateral(name: str) -> dict[str, str]:
    """{generated name: what it is} of all names that the contact, or the side of a stop, ``name`` brings."""
    return {
        gap(name): "gap",
        force(name): "normal force",
        **dict.fromkeys((*frictions(name, 1), *frictions(name, 2)), "friction"),
        impulse(name): "impulse",
        mode(name): "mode",
        impacts(name): "count of impacts",
        impact(name): "clock of impacts",
    }


def of_friction(name: str) -> dict[str, str]:
    """{generated name: what it is} of all names that the friction element ``name`` brings."""
    return {force(name): "force", mode(name): "mode"}


def rate(name: str) -> str:
    """Name of the time derivative of an input, which is no variable of the FMU."""
    return f"rate of {name}"


def damper_rate(damper: str) -> str:
    """Name of the rate of the ``damper`` among those of all dampers, which is no variable of the FMU."""
    return f"rate of dampers.{damper}"


def generalized_force(name: str) -> str:
    """Name of the FMU input for an external generalized force on the coordinate ``name``."""
    return f"Q_{name}"


def momentum(name: str) -> str:
    """Name of the generalized momentum of the coordinate ``name``."""
    return f"p_{name}"


def target(motion: str) -> str:
    """Name of the input that the filtered ``motion`` follows."""
    return f"{motion}_target"


def drive(motion: str) -> str:
    """Name of the generalized force that carries the prescribed ``motion``."""
    return f"F_{motion}"


def drive_power(motion: str) -> str:
    """Name of the power that the drive of the prescribed ``motion`` puts in."""
    return f"P_{motion}"


def derivative(name: str) -> str:
    """Name of the variable that carries the FMI attribute ``derivative`` for the state ``name``."""
    return f"der_{name}"


def multiplier(name: str) -> str:
    """Name of the Lagrange multiplier of the constraint ``name``."""
    return f"multiplier_{name}"


def massless(coordinate: str) -> str:
    """Name of the constraint that keeps the forces on a ``coordinate`` without mass in equilibrium."""
    return f"{_MASSLESS}{coordinate}"


def coordinate_of_massless(constraint: str) -> str:
    """The coordinate whose ``massless`` constraint is called ``constraint``."""
    return constraint.removeprefix(_MASSLESS)


def residual(name: str) -> str:
    """Name of the residual of the constraint ``name``: what should be zero."""
    return f"residual_{name}"


# ---------------------------------------------------------------------------------------- contacts, stops, frictions

DISSIPATED_ENERGY = "dissipated_energy"
"""The variable that closes the balance of energy where there are contacts, stops or frictions."""


def stop_side(stop: str, side: str) -> str:
    """Name of the ``side`` ("lower" or "upper") of a ``stop``, which is a unilateral by itself."""
    return f"{stop}_{side}"


def gap(contact: str) -> str:
    """Name of the gap of the ``contact``, or of the side of a stop."""
    return f"{contact}_gap"


def force(element: str) -> str:
    """Name of the normal force of a contact or of the side of a stop, and of the force of a friction element."""
    return f"{element}_force"


def frictions(contact: str, slips: int) -> tuple[str, ...]:
    """Names of the friction forces of the ``contact`` along its ``slips``: NAME_friction, or NAME_friction_1, _2."""
    return (f"{contact}_friction",) if slips == 1 else tuple(f"{contact}_friction_{k + 1}" for k in range(slips))


def impulse(contact: str) -> str:
    """Name of the normal impulse of the last impact at the ``contact``, or at the side of a stop."""
    return f"{contact}_impulse"


def mode(element: str) -> str:
    """Name of the mode of a contact, of the side of a stop, or of a friction element."""
    return f"{element}_mode"


def impacts(contact: str) -> str:
    """Name of the count of impacts at the ``contact``, or at the side of a stop."""
    return f"{contact}_impacts"


def impact(contact: str) -> str:
    """Name of the clock that ticks at impacts of the ``contact``, or of the side of a stop; in FMI 3.0."""
    return f"{contact}_impact"


def indicator(contact: str) -> str:
    """Name of the indicator of the events at which the ``contact``, or the side of a stop, closes or opens."""
    return f"indicator({contact})"


def slip_indicator(element: str) -> str:
    """Name of the indicator of the events at which a contact or a friction element begins to stick or to slide."""
    return f"indicator({element}, slip)"


def switch_indicator(number: int) -> str:
    """Name of the indicator of the switch with this ``number``, counted from 0."""
    return f"indicator(switch {number + 1})"
