/* Copyright 2026 hysteresis_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/** Give every command a button that copies it. */
function copyButtons() {
  for (const code of document.querySelectorAll('.command code')) {
    const button = element('button', {type: 'button', 'aria-live': 'polite'}, 'Copy');
    button.addEventListener('click', async () => {
      try {
        await navigator.clipboard.writeText(code.textContent);
      } catch (refused) {
        // A page that is opened as a file may not have the clipboard; the selection works there.
        getSelection().selectAllChildren(code);
        document.execCommand('copy');
      }
      button.textContent = 'Copied';
      setTimeout(() => { button.textContent = 'Copy'; }, 2000);
    });
    code.after(button);
  }
}

/** Replace the pictures of the recording by charts. */
function charts() {
  const data = document.getElementById('recording');
  if (!data) return;
  const view = new View(unpacked(JSON.parse(data.textContent)));
  new Controls(document.querySelector('.explore .tools'), view);
  for (const figure of document.querySelectorAll('figure[data-chart]')) {
    if (figure.dataset.chart === 'signals') {
      signalCharts(figure, view);
      continue;
    }
    const image = figure.querySelector('img');
    const place = element('div');
    image.replaceWith(place);
    if (figure.dataset.chart === 'lines') {
      new Lines(place, view, image.alt);
      new Reader(place, view);
    } else {
      new Loop(place, view, image.alt);
    }
  }
  view.change();
}

copyButtons();
charts();
// Paper cannot be unfolded.
addEventListener('beforeprint', () => {
  document.querySelectorAll('details').forEach((one) => { one.open = true; });
});
