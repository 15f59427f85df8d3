# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Managed nodes: unconfigured, inactive, active, as ``ros2 lifecycle`` shows and changes them.

A node says in four methods what comes with a transition. One that raises a `HysteresisError` or an
`OSError` refuses it: the state stays, and the log says why in one line. With the parameter
``autostart`` the node is active as soon as it is there, and what it cannot do ends it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.nodes.parameters import Spec

LIFECYCLE = (
    Spec('autostart', True, 'Whether the node is configured and activated at start; else it waits '
         'for `ros2 lifecycle set`', read_only=True),
)


class ManagedNode(LifecycleNode):
    """
    A node with a lifecycle.

    Parameters
    ----------
    name : str
        Of the node.
    **options
        For `rclpy.node.Node`.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self._failure: Exception | None = None
        self._starting = False
        # An event that the state does not know is an exception of rclpy, which would end the node.
        self._service_change_state.callback = self._on_change_state

    def set_up(self) -> None:
        """Unconfigured to inactive: take what the node works with."""

    def activate(self) -> None:
        """Inactive to active: begin to work."""

    def deactivate(self) -> None:
        """Active to inactive: stop working, the muscle off."""

    def clean_up(self) -> None:
        """Give back what `set_up` took; from any state, and more than once."""

    @property
    def state(self) -> str:
        """The state's label, such as 'active'."""
        return self._state_machine.current_state[1]

    @property
    def active(self) -> bool:
        """Whether the node works."""
        return self._state_machine.current_state[0] == State.PRIMARY_STATE_ACTIVE

    def start(self) -> None:
        """
        Configure and activate the node.

        Raises
        ------
        HysteresisError, OSError
            What the node could not do.
        """
        self._starting = True       # what fails now is told by whoever starts the node
        self._failure = None
        for trigger in (self.trigger_configure, self.trigger_activate):
            trigger()
            if self._failure is not None:
                raise self._failure
        self._starting = False

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition; `set_up` does it."""
        result = self._do(self.set_up, 'configured')
        if result != TransitionCallbackReturn.SUCCESS:
            self.clean_up()
        return result

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition; `activate` does it."""
        return self._do(self.activate, 'activated')

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition; `deactivate` does it."""
        return self._do(self.deactivate, 'deactivated')

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition; `clean_up` does it."""
        return self._do(self.clean_up, 'cleaned up')

    def on_shutdown(self, state: LifecycleState | None = None) -> TransitionCallbackReturn:
        """Answer the transition, and be the first on the way out of the program."""
        return self._do(self.clean_up, 'shut down')

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """After a mistake of ours in a transition: back to where nothing is on."""
        return self._do(self.clean_up, 'cleaned up after an error')

    def _do(self, work: Callable[[], None], what: str) -> TransitionCallbackReturn:
        try:
            work()
        except (HysteresisError, OSError) as error:
            self._report(error, f'not {what}: {_line(error)}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:      # rclpy would drop it without a word
            self._report(error, f'not {what}: unexpected {_line(repr(error))}')
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _report(self, error: Exception, line: str) -> None:
        self._failure = self._failure or error
        if not self._starting and self.context.ok():
            self.get_logger().error(line)

    def _on_change_state(self, request: ChangeState.Request,
                         response: ChangeState.Response) -> ChangeState.Response:
        """Refuse what this state has no transition for; do all else as rclpy does."""
        transitions = self._state_machine.available_transitions
        possible = {number: label for number, label, *_ in transitions}
        wanted: Transition = request.transition
        # A label counts before a number, as rclpy has it.
        number = next((one for one, label in possible.items() if label == wanted.label),
                      None) if wanted.label else wanted.id
        if number not in possible:
            self.get_logger().warning(
                f'transition {wanted.label or wanted.id} refused: the node is {self.state}, and '
                f'can {", ".join(sorted(set(possible.values()))) or "do nothing any more"}')
            response.success = False
            return response
        self._failure = None
        request.transition = Transition(id=number)
        return self._LifecycleNodeMixin__on_change_state(request, response)


def _line(error: object) -> str:
    return ' '.join(str(error).split())
