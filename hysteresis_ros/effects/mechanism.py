# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects on the arm: what it asks of the muscles at rest, and what resists its motion."""

import dataclasses
import math

import numpy as np

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects.base import Parameter, Values
from hysteresis_ros.effects.stages import MechanismEffect, Statics


def add_moment(statics: Statics, moment: Values) -> Statics:
    """Return the arm at rest with a further moment [N m], shape (n,), to be held."""
    return dataclasses.replace(statics, moment=statics.moment + moment)


class CoulombFriction(MechanismEffect):
    """Dry friction in bearings and guides."""

    id = 'coulomb_friction'
    sentence = 'Dry friction holds the arm until the muscle has overcome it.'
    equation = ('tau += tau_c sign(dtheta/dt); at rest the arm sticks as long as '
                '|tau| <= (1 + rest) tau_c')
    source = ('Coulomb friction, larger at rest as of Stribeck (Armstrong-Helouvry and others, '
              'Automatica 30 (1994) 1083)')
    shows_in = 'reversals'
    experiment = 'tap the arm; move it by hand with cold muscles'
    confused_with = ('backlash',)
    parameters = (
        Parameter('tau_c', 'N m', 'moment of friction', 0.001, 0.15, 0.0, (0.01, 0.05),
                  log=True, scale='moment'),
        Parameter('rest', '1', 'share by which it is larger until the arm slides', 0.0, 1.0, 0.0,
                  (0.0, 0.5), limits=(0.0, 1.0), form=True))

    def resistance(self) -> tuple[float, float, float]:
        """Return the friction's moment."""
        return self.tau_c, 0.0, 0.0

    def stiction(self) -> float:
        """Return by what share it is larger at rest."""
        return self.rest


class ViscousFriction(MechanismEffect):
    """Friction that grows with the speed."""

    id = 'viscous_friction'
    sentence = 'The faster the arm moves, the more it is held back.'
    equation = 'tau += b dtheta/dt'
    source = 'viscous friction'
    shows_in = 'dtheta/dt'
    experiment = 'let the arm swing freely'
    confused_with = ('thermal_lag', 'latency')
    needs_transients = True
    invertible = False
    parameters = (
        Parameter('b', 'N m s/rad', 'moment per angular velocity', 0.001, 4.0, 0.0, (0.05, 1.0),
                  log=True, scale='moment'),)

    def resistance(self) -> tuple[float, float, float]:
        """Return the viscous coefficient."""
        return 0.0, self.b, 0.0


class Inertia(MechanismEffect):
    """Payload and forearm have to be accelerated."""

    id = 'inertia'
    sentence = 'The mass of arm and payload makes it ring after a fast step.'
    equation = 'tau += I d2theta/dt2 + b dtheta/dt'
    source = "Newton's second law"
    shows_in = 'ringing'
    experiment = 'pluck the arm and log fast'
    confused_with = ('viscous_friction',)
    replaces = ('viscous_friction',)
    needs_transients = True
    invertible = False
    # Starts are so near each other because a fit finds no way from one period of the ringing to
    # another.
    parameters = (
        Parameter('I', 'kg m^2', 'moment of inertia about the pivot', 0.001, 1.2, 0.0,
                  (0.004, 0.006, 0.009, 0.0135, 0.02, 0.03, 0.045, 0.07, 0.1, 0.15, 0.23, 0.35,
                   0.52, 0.8), log=True, scale='inertia'),
        Parameter('b', 'N m s/rad', 'moment per angular velocity, by which the ringing dies away',
                  0.001, 4.0, 0.0, (0.05,), log=True, scale='moment'),)

    def resistance(self) -> tuple[float, float, float]:
        """Return viscous coefficient and moment of inertia."""
        return 0.0, self.b, self.I


class FrameTilt(MechanismEffect):
    """The frame does not stand upright."""

    id = 'frame_tilt'
    sentence = 'The frame leans, so gravity pulls the forearm at another angle.'
    equation = 'tau(theta) -> tau(theta + phi)'
    source = 'Eq. 16 of the paper with gravity turned by phi'
    shows_in = 'cos theta'
    experiment = 'put a spirit level on the frame'
    confused_with = ('payload_error', 'encoder_offset')
    parameters = (
        Parameter('phi', 'deg', 'angle by which the frame leans forward', 1.0, 25.0, 0.0,
                  (-5.0, 5.0), both_signs=True),)

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Turn the load's moment, and the direction in which other weights pull."""
        upright = statics.upright + math.radians(self.phi)
        turned = geometry.load_moment(upright) - geometry.load_moment(statics.upright)
        return dataclasses.replace(add_moment(statics, turned), upright=upright)


class PayloadError(MechanismEffect):
    """The payload is not what the geometry file says."""

    id = 'payload_error'
    sentence = 'The payload is heavier or lighter than assumed.'
    equation = 'm -> m + dm'
    source = 'Eq. 16 of the paper'
    shows_in = 'gravity curve'
    experiment = 'put the payload on a scale'
    confused_with = ('frame_tilt', 'supply_sag')
    parameters = (
        Parameter('dm', 'g', 'payload above the assumed one', 1.0, 100.0, 0.0,
                  (-20.0, -5.0, 5.0, 20.0), both_signs=True, scale='mass'),)

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Add the weight's moment."""
        arm = geometry.gravity * geometry.forearm_length * np.sin(statics.upright)
        return add_moment(statics, 1e-3 * self.dm * arm)


class ClampMass(MechanismEffect):
    """The clamp has a weight of its own, in addition to the forearm."""

    id = 'clamp_mass'
    sentence = "The clamp's own weight turns the arm, with another phase than the payload."
    equation = 'tau += m_c g r_c sin(theta + phi)'
    source = 'the paper leaves it out below Eq. 16'
    shows_in = 'theta'
    experiment = 'run the arm without a payload'
    confused_with = ('geometry_error',)
    parameters = (
        Parameter('moment', 'g m', 'mass times distance m_c r_c', 0.1, 2.5, 0.0, (0.5,), log=True,
                  scale='moment'),
        Parameter('phi', 'rad', 'direction of its centre against the forearm', 0.0, math.pi, 0.0,
                  (0.0, 1.5), both_signs=True),)

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Add the clamp's moment."""
        return add_moment(statics, 1e-3 * self.moment * geometry.gravity
                          * np.sin(statics.upright + self.phi))


class GeometryError(MechanismEffect):
    """The linkage is not built as the geometry file says."""

    id = 'geometry_error'
    sentence = 'Clamp, anchor or muscle length differ from the geometry that was entered.'
    equation = 'x, a, y, z0 -> x + dx, a + da, y + dy, z0 + dz'
    source = 'Eqs. 17 and 18 of the paper'
    shows_in = 'smooth in theta'
    experiment = 'measure the linkage with a calliper'
    confused_with = ('series_compliance', 'encoder_offset')
    # y and z0 are one number in Eq. 21 to first order, so only their difference is fitted.
    parameters = (
        Parameter('dx', 'mm', 'clamp further out than assumed', 0.5, 5.0, 0.0, (-1.0, 1.0),
                  both_signs=True, scale='lever'),
        Parameter('da', 'mm', 'clamp higher than assumed', 0.5, 5.0, 0.0, (0.0,),
                  both_signs=True, scale='lever'),
        Parameter('dz', 'mm', 'anchor higher, or muscle shorter, than assumed', 0.5, 5.0, 0.0,
                  (0.0,), both_signs=True, scale='lever'),)
    together = ('dx', 'da', 'dz')

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Replace length and moment arm by those of the other linkage."""
        built = dataclasses.replace(
            geometry,
            clamp_distance=max(geometry.clamp_distance + 1e-3 * self.dx, 1e-3),
            clamp_height=max(geometry.clamp_height + 1e-3 * self.da, 0.0),
            anchor_height=max(geometry.anchor_height + 1e-3 * self.dz, 1e-3))
        theta = statics.theta
        return dataclasses.replace(
            statics,
            length=statics.length + (built.length(theta) - geometry.length(theta)),
            moment_arm=statics.moment_arm + (
                built.moment_arm(theta) - geometry.moment_arm(theta)))


class EndStop(MechanismEffect):
    """The arm runs against a stop."""

    id = 'end_stop'
    sentence = 'At one end the arm meets a stop and goes no further.'
    equation = 'tau -= k (theta - stop) beyond the stop'
    source = 'unilateral spring'
    shows_in = 'one end of theta'
    experiment = 'drive the arm slowly into the stop'
    confused_with = ('slack', 'supply_limit')
    invertible = False
    parameters = (
        Parameter('stop', 'rad', 'angle of the stop', 0.0, math.pi, -1.0,
                  (0.9, 1.2, 1.5, 1.8, 2.1)),
        Parameter('side', '1', '1: the arm cannot go above the stop, -1: not below it', -1.0, 1.0,
                  0.0, (1.0, -1.0), choices=(-1.0, 1.0)),
        Parameter('stiffness', 'N m/rad', 'stiffness of the stop', 1.0, 1000.0, 0.0, (5.0,),
                  log=True, scale='moment'),)

    def guesses(self, measured: np.ndarray) -> list[dict[str, float]]:
        """Where the response ends there may be a stop."""
        return [{'stop': float(np.max(measured)), 'side': 1.0},
                {'stop': float(np.min(measured)), 'side': -1.0}]

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Let the stop carry the load beyond it."""
        beyond = np.maximum(self.side * (statics.theta - self.stop), 0.0)
        return add_moment(statics, -self.side * self.stiffness * beyond)
