// A result's frames and blocks from the worst on; a click shows them in the pictures.

const mostFrames = 40;

function showWorst(report) {
  const {results = [], frames = [], pictured = [], block} = report;
  if (!results.some(({places}) => places?.length)) return;
  $('worst').hidden = false;
  const figures =
      timeFigures.filter(({key}) => results.some(({quality}) => quality.frames.some((frame) => key in frame)));
  fill($('worst-of'), results.map(({name}) => ({label: name})));
  fill($('worst-by'), figures.map(({heading}) => ({label: heading})));
  $('worst-of').value = Math.max(0, results.length - 1);
  $('worst-note').textContent =
      `Places are blocks of ${block}×${block} pixels of the frames that are pictured, by their PSNR. ` +
      'Of other frames the nearest picture is shown.';

  const entry = (text, value, go) => {
    const button = html('button', {type: 'button'}, text, html('span', {class: 'value'}, value));
    button.addEventListener('click', go);
    return html('li', {}, button);
  };

  function list() {
    const {name, quality, places} = results[$('worst-of').value];
    const {key, unit, decimals, most} = figures[$('worst-by').value];
    const order = quality.frames.map((frame, index) => ({index, value: frame[key]}))
                      .filter(({value}) => value !== undefined)
                      .sort((a, b) => (most ? 1 : -1) * (a.value - b.value));
    $('worst-frames')
        .replaceChildren(...order.slice(0, mostFrames).map(({index, value}) => entry(
            `Frame ${frames[index]}`, value.toFixed(decimals) + unit, () => report.showResult(name, index))));
    $('worst-places').replaceChildren(...places.map((place) => {
      const frame = pictured[place.picture];
      return entry(
          `Frame ${frames[frame]} at ${place.x}, ${place.y}`, `${place.psnr.toFixed(2)} dB`,
          () => report.showResult(name, frame, place));
    }));
  }
  for (const id of ['worst-of', 'worst-by']) $(id).addEventListener('change', list);
  list();
}
