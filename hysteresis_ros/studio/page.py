# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The page itself: what a `Session` knows as elements of NiceGUI, and its methods as buttons."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
import os
from typing import TYPE_CHECKING, TypeVar

from nicegui import app, run, ui

from hysteresis_ros.comparison.where import number
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.report.words import verdict_in_words
from hysteresis_ros.studio import charts
from hysteresis_ros.studio.jobs import Job
from hysteresis_ros.studio.session import MODEL_NAME, REPORT_NAME

if TYPE_CHECKING:
    from hysteresis_ros.studio.feed import Feed
    from hysteresis_ros.studio.session import Session
    from hysteresis_ros.studio.sliders import Slider
    from hysteresis_ros.studio.views import Entry, Errors

Result = TypeVar('Result')
# Time between two looks at whether another tab, a job or the arm has changed something [s].
LOOK = 0.3
STEP = 0.002
# Below this share of the first error the present one is shown as less.
LESS = 0.98
# Effects with this probability [%] stand on top.
LISTED = 0.5
DARK_QUERY = 'matchMedia("(prefers-color-scheme: dark)")'
WATCH_DARK = (
    '<script>addEventListener("load", () => {'
    f'const query = {DARK_QUERY};'
    'query.addEventListener("change", () => emitEvent("shade", query.matches));'
    '});</script>')
# Jobs go on when a tab is closed; each session has one at a time.
_jobs: dict[int, Job] = {}


class Number:
    """
    An error before and now, in large digits.

    Parameters
    ----------
    name : str
        What it is.
    """

    def __init__(self, name: str) -> None:
        with ui.element('div').classes('number') as self._box:
            ui.label(name).classes('soft')
            with ui.element('div').classes('values'):
                self._before = ui.label().classes('before')
                self._now = ui.label().classes('now')

    def show(self, errors: Errors | None, unit: str, scale: float) -> None:
        """Show errors in a unit that is `scale` times that of the response; None hides it."""
        self._box.visible = errors is not None
        if errors is not None:
            self._before.text = f'{number(scale * errors.before)} →'
            self._now.text = f'{number(scale * errors.now)} {unit}'
            falls = errors.now < LESS * errors.before
            self._box.classes(add='better' if falls else 'same',
                              remove='same' if falls else 'better')


class Page:
    """
    One tab that shows a session.

    Parameters
    ----------
    session : Session
    feed : Feed, optional
        The recording of a live arm.
    """

    def __init__(self, session: Session, feed: Feed | None = None) -> None:
        self.session, self.feed = session, feed
        self._colours = charts.LIGHT
        self._seen = -1
        self._pending: dict[str, float] = {}
        self._sliding = False
        self._values: dict[str, ui.label] = {}
        self._units: dict[str, str] = {}
        self._lines: list[ui.label] = []
        # What the parts of the page show now: they are made anew only when that has changed, or a
        # live recording would take a box away under the pointer.
        self._shown: dict[str, object] = {}

    def build(self) -> None:
        """Put the elements of the page together."""
        ui.add_css((files('hysteresis_ros.studio') / 'web' / 'studio.css').read_text('utf-8'))
        ui.colors(primary='#2f6db5')
        ui.add_head_html(WATCH_DARK)
        ui.on('shade', lambda event: self._shade(bool(event.args)))
        with ui.element('main').classes('studio'):
            with ui.element('section').classes('left').props('aria-label="Effects"'):
                self._left()
            with ui.element('div').classes('work'):
                with ui.element('section').classes('errors').props(
                        'aria-label="Errors" aria-live="polite"'):
                    self._errors()
                with ui.element('section').classes('middle').props('aria-label="Response"'):
                    self._middle()
                with ui.element('section').classes('right').props('aria-label="Parameters"'):
                    self._right()
                with ui.element('section').classes('below').props('aria-label="Commands"'):
                    ui.label('What was done, as commands').classes('heading')
                    self._commands = ui.element('div').classes('commands')
        self._show_all()
        ui.timer(LOOK, self._look)
        ui.timer(0.05, self._ask_shade, once=True)

    def _left(self) -> None:
        ui.label('hysteresis studio').classes('title')
        with ui.row().classes('line'):
            self._diagnose = ui.button('diagnose', on_click=self._on_diagnose).props(
                'no-caps dense unelevated')
            self._stop = ui.button('stop', on_click=self._on_stop).props('no-caps dense flat')
        self._bar = ui.linear_progress(0.0, show_value=False).props('aria-label="Progress"')
        self._verdict = ui.label().classes('verdict')
        self._catalogue = ui.element('div').classes('catalogue')

    def _errors(self) -> None:
        self._about = ui.label().classes('soft')
        with ui.element('div').classes('numbers'):
            self._numbers = {'fitted': Number('RMSE, fitted rows'),
                             'unseen': Number('RMSE, unseen rows')}

    def _middle(self) -> None:
        self._parts = ui.element('div').classes('line')
        self._trouble = ui.label().classes('warning')
        self._chart = ui.echart({}).classes('chart')

    def _right(self) -> None:
        with ui.row().classes('line'):
            self._fit = ui.button('fit', on_click=self._on_fit).props('no-caps dense unelevated')
            ui.button('report', on_click=self._on_report).props('no-caps dense outline')
            self._report = ui.link('', '#', new_tab=True)
        with ui.row().classes('line'):
            self._file = ui.input('file', value=MODEL_NAME).props('dense outlined').classes('file')
            self._save = ui.button('save model', on_click=self._on_save).props(
                'no-caps dense outline')
        if self.feed is not None:
            feed = self.feed
            with ui.row().classes('line'):
                ui.switch('listen to the arm', value=feed.listening,
                          on_change=lambda event: setattr(feed, 'listening', event.value))
                ui.button('save recording', on_click=self._on_save_recording).props(
                    'no-caps dense outline')
        self._note = ui.label().classes('soft')
        self._sliders = ui.element('div').classes('sliders')

    # What is shown.

    def _show_all(self) -> None:
        self._seen = self.session.version
        session = self.session
        names = ', '.join(os.path.basename(os.path.normpath(one.source))
                          for one in session.recordings)
        self._about.text = (f'{os.path.basename(session.model_path)} on '
                            f'{names or "an arm that has not been heard yet"}')
        self._show_catalogue()
        self._show_parts()
        self._show_sliders()
        self._show_chart()
        self._show_errors()

    def _is_shown(self, part: str, content: object) -> bool:
        """Whether a part of the page shows this already; from now on it does."""
        if self._shown.get(part, self) == content:
            return True
        self._shown[part] = content
        return False

    def _show_catalogue(self) -> None:
        found = self.session.diagnosis
        self._verdict.text = verdict_in_words(found) if found else ''
        self._verdict.visible = found is not None
        entries = self.session.catalogue()
        if self._is_shown('catalogue', (entries, self.session.probabilities(),
                                        self.session.ready)):
            return
        self._catalogue.clear()
        with self._catalogue:
            if found:
                likely = [one for one in entries if 100.0 * (one.probability or 0.0) >= LISTED]
                likely.sort(key=lambda one: -(one.probability or 0.0))
                unknown = self.session.probabilities().get('unknown', 0.0)
                self._group('probable', likely)
                if 100.0 * unknown >= LISTED:
                    with ui.element('div').classes('effect'):
                        ui.label('unknown cause').classes('unknown')
                        self._share(unknown)
                entries = [one for one in entries if one not in likely]
            for stage in dict.fromkeys(one.stage for one in entries):
                self._group(stage, [one for one in entries if one.stage == stage])

    def _group(self, name: str, entries: list[Entry]) -> None:
        if entries:
            ui.label(name).classes('heading')
        for entry in entries:
            row = ui.element('div').classes('effect')
            if entry.hidden:
                row.classes('dim')
            with row:
                box = ui.checkbox(entry.name, value=entry.ticked or entry.built_in).props('dense')
                box.on_value_change(
                    lambda event, name=entry.name: self._on_tick(name, event.value))
                box.set_enabled(not entry.built_in and self.session.ready)
                if entry.built_in:
                    ui.label('in the model').classes('soft')
                elif entry.hidden:
                    ui.label('cannot show').classes('soft')
                elif entry.probability is not None:
                    self._share(entry.probability)
                ui.tooltip(entry.sentence + (f' These recordings cannot show it: {entry.hidden}.'
                                             if entry.hidden else ''))

    @staticmethod
    def _share(probability: float) -> None:
        percent = 100.0 * probability
        ui.label(f'{percent:.0f} %' if percent >= LISTED or percent == 0.0 else '< 1 %').classes(
            'percent')
        if percent >= LISTED:
            with ui.element('div').classes('share'):
                ui.element('div').style(f'width: {percent:.1f}%')

    def _show_parts(self) -> None:
        session = self.session
        if self._is_shown('parts', (list(session.parts), list(session.unseen))):
            return
        self._parts.clear()
        if len(session.parts) < 2:
            return
        with self._parts:
            ui.label('fitted:').classes('soft')
            for part in session.parts:
                ui.checkbox(part.name, value=part not in session.unseen).props(
                    'dense').on_value_change(
                    lambda event, name=part.name: self._on_part(name, event.value))

    def _show_sliders(self) -> None:
        session = self.session
        found = session.sliders()
        fixed = [effect.id for effect in session.effects
                 if effect.id not in {one.effect for one in found}]
        self._fit.set_enabled(bool(session.effects))
        self._save.set_enabled(bool(session.effects))
        if not session.effects:
            self._note.text = 'Tick an effect: its parameters stand here.'
        elif session.extension is not None:
            self._note.text = 'Fitted; in brackets 95 % intervals.'
        else:
            self._note.text = 'Set by hand.'
        if self._is_shown('sliders', (found, fixed)):
            return
        self._sliders.clear()
        self._values.clear()
        with self._sliders:
            for name in dict.fromkeys([*(one.effect for one in found), *fixed]):
                ui.label(name).classes('heading')
                for slider in found:
                    if slider.effect == name:
                        self._slider(slider)

    def _slider(self, slider: Slider) -> None:
        choices = slider.choices
        with ui.element('div').classes('slider'):
            ui.label(slider.parameter.name).classes('name')
            self._units[slider.name] = slider.unit
            self._values[slider.name] = ui.label(written(slider)).classes('value')
            control = ui.slider(
                min=0.0, max=float(len(choices) - 1) if choices else 1.0,
                step=1.0 if choices else STEP, value=slider.position,
                on_change=lambda event: self._on_slide(slider, float(event.value)))
            control.props(f'aria-label="{slider.name}" dense')
            ends = f'{number(slider.low)} to {number(slider.high)} {slider.unit}'
            ui.label(f'{slider.parameter.description}, {ends}'
                     + (', logarithmic' if slider.logarithmic else '')).classes('soft small')

    def _show_chart(self) -> None:
        self._chart.visible = self.session.ready
        if self.session.ready:
            self._chart.options.clear()
            self._chart.options.update(charts.options(self.session.curves(), self._colours))
            self._chart.update()

    def _show_errors(self) -> None:
        """Show the errors and the commands, which change with every move of a slider."""
        session = self.session
        unit, scale = shown(session.quantity)
        errors = session.errors() if session.ready else {}
        for name, shown_number in self._numbers.items():
            shown_number.show(errors.get(name), unit, scale)
        trouble = self.feed.trouble if self.feed else ''
        if self.feed is not None and not session.ready and not trouble:
            trouble = ('waiting for joint_states and applied_voltage: is the bridge running, on '
                       'this ROS_DOMAIN_ID?')
        self._trouble.text, self._trouble.visible = trouble, bool(trouble)
        lines = session.commands()
        if len(lines) != len(self._lines):
            self._commands.clear()
            with self._commands:
                self._lines = [self._command() for _ in lines]
        for label, line in zip(self._lines, lines):
            label.text = line

    @staticmethod
    def _command() -> ui.label:
        with ui.element('div').classes('command'):
            label = ui.label().classes('code')
            ui.button(icon='content_copy', on_click=lambda: copy(label.text)).props(
                'flat dense size=sm aria-label="Copy the command"')
        return label

    # What is done.

    def _shade(self, dark: bool) -> None:
        colours = charts.DARK if dark else charts.LIGHT
        if colours is not self._colours:
            self._colours = colours
            self._show_chart()

    async def _ask_shade(self) -> None:
        self._shade(bool(await ui.run_javascript(f'{DARK_QUERY}.matches', timeout=10.0)))
        # The chart may have been made before the columns of the page had their widths.
        self._chart.run_chart_method('resize')

    def _look(self) -> None:
        """Take in what another tab, a job or the arm has changed."""
        job = _jobs.get(id(self.session))
        running = job is not None and job.running
        for button in (self._diagnose, self._fit):
            button.set_enabled(not running and self.session.ready and (
                button is self._diagnose or bool(self.session.effects)))
        self._stop.visible = self._bar.visible = running
        if job is not None and running:
            self._bar.props(add='indeterminate' if job.share is None else '',
                            remove='' if job.share is None else 'indeterminate')
            self._bar.value = job.share or 0.0
        elif job is not None and job.error:
            ui.notify(job.error, type='negative', multi_line=True, timeout=10000)
            job.error = ''
        if self._seen != self.session.version and not self._sliding:
            self._show_all()

    async def _do(self, action: Callable[..., Result], *values: object) -> Result | None:
        """Return the result of an action in a thread, None if it is refused; then say why."""
        try:
            return await run.io_bound(action, *values)
        except (HysteresisError, OSError) as error:
            ui.notify(' '.join(str(error).split()), type='negative', multi_line=True,
                      timeout=10000)
            return None

    async def _on_tick(self, name: str, on: bool) -> None:
        await self._do(self.session.tick, name, on)
        # A box that was ticked in vain has to be drawn anew, though nothing has changed.
        self._shown.pop('catalogue', None)
        self._show_all()

    async def _on_part(self, name: str, fitted: bool) -> None:
        unseen = {part.name for part in self.session.unseen}
        unseen = unseen - {name} if fitted else unseen | {name}
        await self._do(self.session.hold_out, unseen)
        self._shown.pop('parts', None)
        self._show_all()

    async def _on_slide(self, slider: Slider, position: float) -> None:
        """Simulate at the latest position; those that came meanwhile are left out."""
        self._pending[slider.name] = slider.at(position)
        if self._sliding:
            return
        self._sliding = True
        try:
            while self._pending:
                values, self._pending = self._pending, {}
                for name, value in values.items():
                    await self._do(self.session.slide, name, value)
                    if name in self._values:
                        self._values[name].text = f'{value:.4g} {self._units[name]}'
                self._seen = self.session.version
                self._chart.run_chart_method('setOption', charts.moved(self.session.curves()))
                self._show_errors()
                self._note.text = 'Set by hand.'
        finally:
            self._sliding = False

    def _start(self, name: str, work: Callable[..., object]) -> None:
        job = _jobs.get(id(self.session))
        if job is None or not job.running:
            _jobs[id(self.session)] = Job(name, work)
        self._look()

    def _on_diagnose(self) -> None:
        self._start('diagnose', self.session.diagnose)

    def _on_fit(self) -> None:
        self._start('fit', lambda progress: self.session.fit())

    def _on_stop(self) -> None:
        job = _jobs.get(id(self.session))
        if job is not None:
            job.stop()

    async def _on_save(self) -> None:
        path = await self._do(self.session.save, self._file.value or '')
        if path:
            ui.notify(f'written to {path}', type='positive')

    async def _on_save_recording(self) -> None:
        if self.feed is not None and self.session.ready:
            path = await self._do(self.feed.save)
            if path:
                ui.notify(f'written to {path}', type='positive')

    async def _on_report(self) -> None:
        path = await self._do(self.session.report, REPORT_NAME)
        if path:
            address = f'/report/{self.session.version}'
            app.add_static_file(local_file=path, url_path=address, max_cache_age=0)
            self._report.text = os.path.basename(path)
            self._report.props(f'href="{address}"')


def copy(text: str) -> None:
    """Put a text on the browser's clipboard."""
    ui.clipboard.write(text)
    ui.notify('copied')


def written(slider: Slider) -> str:
    """Return a value with its unit and, if it was fitted, its interval."""
    text = f'{slider.value:.4g} {slider.unit}'
    if slider.interval is not None and slider.interval[0] != slider.interval[1]:
        low, high = slider.interval
        text += f' ({low:.3g} to {high:.3g})'
    return text
