"""Actuators and tendons of a model that MuJoCo compiled: forces on coordinates, at sites and between them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import numpy as np

from lag2fmu.formats.robots.compiled import Compiled, turned
from lag2fmu.formats.robots.tree import (
    Activation,
    Actuator,
    Limits,
    Muscle,
    Span,
    Sum,
    Tendon,
    Transmission,
    Turning,
    Wrench,
)

_FREE, _BALL = 0, 1  # mjtJoint


def actuators(compiled: Compiled) -> Iterator[Actuator]:
    """Those whose force is affine in the control, the length and its rate; the others are noted as ignored."""
    m, own = compiled.model, compiled.mujoco
    for k in range(len(m.actuator_trntype)):
        name = compiled.name("actuator", k)
        muscle = _muscle(compiled, k)
        bias = _affine(m.actuator_biasprm[k], 3 if m.actuator_biastype[k] == own.mjtBias.mjBIAS_AFFINE else 0)
        gain = _affine(m.actuator_gainprm[k], 3 if m.actuator_gaintype[k] == own.mjtGain.mjGAIN_AFFINE else 1)
        through = _transmission(compiled, k) if muscle or _is_plain(compiled, k) else None
        if through is None or not _follows(through, gain, bias, muscle):
            compiled.ignored.append(f"the actuator {name}: {_why_not(compiled, k)}")
            continue
        compiled.note(
            {
                f"damping and armature of the actuator {name}": (
                    "actuator_damping",
                    "actuator_dampingpoly",
                    "actuator_armature",
                ),
            },
            {"actuator": k},
        )
        force_limits = limits_of(m.actuator_forcerange[k]) if m.actuator_forcelimited[k] else None
        state = None if muscle else _activation(compiled, k)
        yield Actuator(name, through, gain, bias, _control_limits(compiled, k), force_limits, state, muscle)


def _why_not(compiled: Compiled, k: int) -> str:
    """Why actuator ``k`` is not taken."""
    m, own = compiled.model, compiled.mujoco
    if not _is_on(compiled, k):
        return "it is off, late, or has several controls"
    if int(m.actuator_trntype[k]) == int(own.mjtTrn.mjTRN_BODY):
        return "adhesion pulls at contacts, which here only push"
    if int(m.actuator_gaintype[k]) == int(own.mjtGain.mjGAIN_MUSCLE):
        return "a muscle acts along joints and tendons without wraps, and has one curve"
    if not _follows_control(compiled, k):
        return "its state is neither a filter nor an integrator of its control"
    if _transmission(compiled, k) is None:
        return "it acts along none of joints, sites, and tendons without wraps"
    return "along what it acts on, no force depends on control, length and rate as its own does"


def _muscle(compiled: Compiled, k: int) -> Muscle | None:
    """The curves of actuator ``k``, None if it is no muscle, or one whose active and passive curves differ."""
    m, own = compiled.model, compiled.mujoco
    curves = [float(x) for x in m.actuator_gainprm[k][:9]]
    muscular = (
        int(m.actuator_gaintype[k]) == int(own.mjtGain.mjGAIN_MUSCLE)
        and int(m.actuator_biastype[k]) == int(own.mjtBias.mjBIAS_MUSCLE)
        and int(m.actuator_dyntype[k]) == int(own.mjtDyn.mjDYN_MUSCLE)
    )
    least, most = map(float, m.actuator_lengthrange[k])
    if not (muscular and _is_on(compiled, k) and most > least and curves == [*map(float, m.actuator_biasprm[k][:9])]):
        return None
    first, last, peak, scale, lmin, lmax, vmax, fpmax, fvmax = curves
    unit = (most - least) / (last - first)
    rise, fall, smoothing = map(float, m.actuator_dynprm[k][:3])
    peak = scale / float(m.actuator_acc0[k]) if peak < 0.0 else peak
    optimal = least + (1.0 - first) * unit
    return Muscle(peak, optimal, unit, lmin, lmax, vmax, fpmax, fvmax, rise, fall, smoothing)


def _control_limits(compiled: Compiled, k: int) -> Limits | None:
    """The limits at which the control of actuator ``k`` saturates, None where it does not."""
    m = compiled.model
    control = int(m.actuator_ctrladr[k]) if hasattr(m, "actuator_ctrladr") else k
    saturates = m.actuator_ctrllimited[control] and not compiled.disabled("CLAMPCTRL")
    return limits_of(m.actuator_ctrlrange[control]) if saturates else None


def limits_of(pair: Sequence[float]) -> Limits:
    """The ``pair`` of a list of ranges."""
    low, high = map(float, pair)
    return low, high


def _activation(compiled: Compiled, k: int) -> Activation | None:
    """The state of actuator ``k``, if it has one."""
    m, kinds = compiled.model, compiled.mujoco.mjtDyn
    kind = int(m.actuator_dyntype[k])
    if kind == kinds.mjDYN_NONE:
        return None
    limits = limits_of(m.actuator_actrange[k]) if m.actuator_actlimited[k] else None
    word = "integrator" if kind == kinds.mjDYN_INTEGRATOR else "filter"
    return Activation(word, float(m.actuator_dynprm[k][0]), limits)


def _affine(numbers: Iterable[float], count: int) -> tuple[float, float, float]:
    """The first ``count`` of ``numbers``, and 0 up to three."""
    first, second, third = (float(x) if k < count else 0.0 for k, x in enumerate(islice(numbers, 3)))
    return first, second, third


def _follows(through: Transmission, gain: Sequence[float], bias: Sequence[float], muscle: Muscle | None) -> bool:
    """Whether a force can depend on length and rate as ``gain`` and ``bias``, or the curves of a ``muscle``, say."""
    if isinstance(through, (tuple, Span)):
        return True
    rate = isinstance(through, Turning) or not (gain[2] or bias[2])
    return muscle is None and rate and not (gain[1] or bias[1])


def _is_plain(compiled: Compiled, k: int) -> bool:
    """Whether the actuator is on, and has a state at most and a force affine in this or its control."""
    m, own = compiled.model, compiled.mujoco
    return bool(
        _is_on(compiled, k)
        and int(m.actuator_gaintype[k]) in map(int, (own.mjtGain.mjGAIN_AFFINE, own.mjtGain.mjGAIN_FIXED))
        and int(m.actuator_biastype[k]) in map(int, (own.mjtBias.mjBIAS_AFFINE, own.mjtBias.mjBIAS_NONE))
        and _follows_control(compiled, k)
    )


def _is_on(compiled: Compiled, k: int) -> bool:
    """Whether actuator ``k`` is on, and has one control without delay."""
    m, own = compiled.model, compiled.mujoco
    off = m.opt.disableflags & int(own.mjtDisableBit.mjDSBL_ACTUATION)
    group = int(m.actuator_group[k])
    off = off or (0 <= group < 31 and int(m.opt.disableactuator) >> group & 1)
    delayed = hasattr(m, "actuator_delay") and m.actuator_delay[k]
    several = hasattr(m, "actuator_ctrlnum") and m.actuator_ctrlnum[k] != 1
    return not (off or delayed or several)


def _follows_control(compiled: Compiled, k: int) -> bool:
    """Whether actuator ``k`` has no state, or one that integrates or filters its control and acts in its own time."""
    m, kinds = compiled.model, compiled.mujoco.mjtDyn
    kind = int(m.actuator_dyntype[k])
    filters = kind in map(int, (kinds.mjDYN_FILTER, kinds.mjDYN_FILTEREXACT)) and m.actuator_dynprm[k][0] > 0
    one = not (hasattr(m, "actuator_actnum") and m.actuator_actnum[k] > 1) and not m.actuator_actearly[k]
    return bool(kind == kinds.mjDYN_NONE or (one and (filters or kind == kinds.mjDYN_INTEGRATOR)))


def _transmission(compiled: Compiled, k: int) -> Transmission | None:
    """What the force of the actuator acts along; None for what is not taken."""
    m, kinds = compiled.model, compiled.mujoco.mjtTrn
    kind, target, gear = int(m.actuator_trntype[k]), int(m.actuator_trnid[k][0]), [float(x) for x in m.actuator_gear[k]]
    if kind == kinds.mjTRN_TENDON:
        length = tendon_of(compiled, target)
        if isinstance(length, Span):
            return Span(length.spots, gear[0])
        return None if length is None else tuple((joint, gear[0] * factor) for joint, factor in length)
    if kind in (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT):
        name, joint = compiled.name("joint", target), int(m.jnt_type[target])
        if joint in (_FREE, _BALL):
            along = gear[:3] if joint == _BALL else gear
            return Turning(name, tuple(along), in_parent=bool(kind == kinds.mjTRN_JOINTINPARENT))
        return ((name, gear[0]),)
    if kind == kinds.mjTRN_SITE and m.actuator_trnid[k][1] < 0:  # else relative to another site
        matrix = turned(m.site_quat[target])
        force, torque = (tuple(map(float, matrix @ part)) for part in (gear[:3], gear[3:]))
        return Wrench(*_site(compiled, target), force, torque)
    return None


def _site(compiled: Compiled, site: int) -> tuple[str, tuple[float, ...]]:
    """The body of a site, and its place there."""
    m = compiled.model
    return compiled.body(int(m.site_bodyid[site])), tuple(map(float, m.site_pos[site]))


def tendon_of(compiled: Compiled, index: int) -> Sum | Span | None:
    """The joints of a fixed tendon with their factors, or the sites of a spatial one without wraps; None for others."""
    m, kinds, first = compiled.model, compiled.mujoco.mjtWrap, compiled.model.tendon_adr[index]
    wraps = range(first, first + m.tendon_num[index])
    if all(m.wrap_type[w] == kinds.mjWRAP_JOINT for w in wraps):
        return tuple((compiled.name("joint", int(m.wrap_objid[w])), float(m.wrap_prm[w])) for w in wraps)
    if any(m.wrap_type[w] != kinds.mjWRAP_SITE for w in wraps):
        return None
    return Span(tuple(_site(compiled, int(m.wrap_objid[w])) for w in wraps))


def tendons(compiled: Compiled) -> Iterator[Tendon]:
    """Those along which something acts by itself; what nothing is made of is noted as ignored."""
    m = compiled.model
    for k in range(m.ntendon):
        name, length = compiled.name("tendon", k), tendon_of(compiled, k)
        low, high = map(float, m.tendon_lengthspring[k])
        stiffness, damping, armature, friction = (
            float(np.ravel(getattr(m, f"tendon_{what}")[k])[0]) if hasattr(m, f"tendon_{what}") else 0.0
            for what in ("stiffness", "damping", "armature", "frictionloss")
        )
        limits = limits_of(m.tendon_range[k]) if m.tendon_limited[k] else None
        tendon = Tendon(name, length or (), stiffness, (low, high), damping, armature, friction, limits)
        if length is None and tendon.acts:
            compiled.ignored.append(f"the tendon {name}")
        elif tendon.acts:
            yield tendon
        compiled.note(
            {
                f"limits of the actuators' force on the tendon {name}": ("tendon_actfrclimited",),
                f"polynomials of the tendon {name}": ("tendon_stiffnesspoly", "tendon_dampingpoly"),
                f"yield of the spring of the tendon {name}": ("tendon_springyield",) if stiffness else (),
            },
            {"tendon": k},
        )
