// The results' figures: frame by frame, and against their time.

const timeFigures = [
  {key: 'psnr', heading: 'PSNR', unit: ' dB', decimals: 2, most: true},
  {key: 'ssim', heading: 'SSIM', unit: '', decimals: 4, most: true},
  {key: 'if_ssim', heading: 'IF-SSIM', unit: '', decimals: 4, most: true},
  {key: 'flip', heading: 'FLIP', unit: '', decimals: 4, most: false},
  {key: 'disoccluded_4_psnr', heading: 'Disoccluded 4', unit: ' dB', decimals: 2, most: true},
  {key: 'worst_blocks_psnr', heading: 'Worst 1 %', unit: ' dB', decimals: 2, most: true},
  {key: 'vmaf', heading: 'VMAF', unit: '', decimals: 2, most: true},
  {key: 'lpips', heading: 'LPIPS', unit: '', decimals: 4, most: false},
  {key: 'pq_psnr', heading: 'PQ PSNR', unit: ' dB', decimals: 2, most: true},
];
const sequenceFigures = [
  timeFigures[0],
  {key: 'pooled_psnr', heading: 'Pooled PSNR', unit: ' dB', decimals: 2, most: true},
  timeFigures[1],
  timeFigures[2],
  {key: 'pixel_std', heading: 'Pixel std', unit: '', decimals: 2, most: false},
  ...timeFigures.slice(3),
  {key: 'strred', heading: 'STRRED', unit: '', decimals: 2, most: false},
];

function showQualityOverTime(report) {
  const {results = [], frames = []} = report;
  const figures =
      timeFigures.filter(({key}) => results.some(({quality}) => quality.frames.some((frame) => key in frame)));
  if (!figures.length || frames.length < 2) return;
  $('over-time').hidden = false;
  let cursor = report.firstShown ?? 0;
  const redraws = [], values = figures.map(() => html('span', {class: 'values'}));

  function readout() {
    $('time-readout')
        .replaceChildren(
            html('span', {class: 'muted'}, `Frame ${frames[cursor]}`),
            ...results.map(({name, color}) => html('span', {}, swatch(color), name)));
    figures.forEach(
        ({key, decimals}, index) => values[index].replaceChildren(...results.map(
            ({color, quality}) =>
                html('span', {}, swatch(color), quality.frames[cursor][key]?.toFixed(decimals) ?? '–'))));
  }
  const nearestFrame = (place) => Math.min(Math.max(Math.round(place), 0), frames.length - 1);
  function moveTo(place) {
    cursor = nearestFrame(place);
    readout();
    redraws.forEach((redraw) => redraw());
  }
  report.frameShown = moveTo;

  figures.forEach((figure, place) => {
    const series =
        results.map(({color, quality}) => ({color, values: quality.frames.map((frame) => frame[figure.key])}));
    const all = series.flatMap(({values}) => values).filter((value) => value !== undefined);
    const spread = Math.max(Math.max(...all) - Math.min(...all), 10 ** -figure.decimals);
    const low = Math.min(...all) - 0.06 * spread, high = Math.max(...all) + 0.06 * spread;
    const container = html('figure');
    $('time-charts')
        .append(html(
            'div', {}, html('h3', {}, figure.heading + (figure.unit && ` (${figure.unit.trim()})`), values[place]),
            container));

    redraws.push(chart(container, (width) => {
      const height = 190, top = 6, bottom = height - 24, left = 44, right = width - 8;
      const x = linear(0, frames.length - 1, left, right), y = linear(low, high, bottom, top);
      const {values: rows, decimals} = ticks(low, high, 4);
      const children = rows.flatMap(
          (value) =>
              [horizontal(y(value), left, right, 'grid'),
               label(left - 8, y(value) + 4, value.toFixed(decimals), 'end')]);
      for (const index of ticks(0, frames.length - 1, Math.max(2, Math.floor(width / 90)))
               .values.filter(Number.isInteger)) {
        children.push(label(
            x(index), height - 6, frames[index],
            index === 0               ? 'start' :
                x(index) > right - 16 ? 'end' :
                                        'middle'));
      }
      children.push(vertical(x(cursor), top, bottom, 'cursor'));
      for (const {color, values: points} of series) {
        const shown = points.map((value, index) => [index, value]).filter(([, value]) => value !== undefined);
        children.push(path(shown.map(([index, value]) => [x(index), y(value)]), 'line', `stroke: ${color}`));
        if (points[cursor] !== undefined)
          children.push(svg('circle', {cx: x(cursor), cy: y(points[cursor]), r: 4, style: `fill: ${color}`}));
      }
      return {
        height,
        children,
        attributes: {
          tabindex: 0,
          role: 'group',
          'aria-label': `${figure.heading} of every frame; left and right keys move the cursor`
        },
        listeners: browsing({
          nearest: (at) => nearestFrame(((at - left) / (right - left)) * (frames.length - 1)),
          current: cursor,
          count: frames.length,
          go: moveTo,
          pick: report.showNearest
        }),
      };
    }));
  });
  readout();
}

// Where a frame's time is from: a set of {model name: seconds}.
function timesOf(report) {
  const times = new Map();
  const add = (label, group, model, seconds) => {
    if (!(seconds > 0)) return;  // devices whose clocks are too coarse: it has no place on a logarithmic axis
    if (!times.has(group + label)) times.set(group + label, {label, group, of: new Map()});
    times.get(group + label).of.set(model, seconds);
  };
  for (const {name, run} of report.results ?? []) {
    if (!run?.stages?.length) continue;
    const seconds = (of) => run.stages.filter(({device}) => device === of).reduce((sum, stage) => sum + stage.seconds, 0);
    add(`${deviceNames(run)}, ${sizeText(run.output_size)}, ${run.precision}`, 'These results, stages on the device',
        name, Math.max(...run.devices.map((_, index) => seconds(index))));
  }
  for (const {name: file, bench} of report.benches ?? []) {
    const devices = new Map(bench.devices.map(({profile}) => [profile.selector, deviceLabel(report, file, profile)]));
    for (const {device, model, output_size, precision, score} of bench.items) {
      if (!score) continue;
      for (const result of report.results ?? []) {
        if ((result.run?.model.name ?? result.name) !== model.name) continue;
        add(`${devices.get(device)}, ${sizeText(output_size)}, ${precision}`, `${file}, a frame by the host's clock`,
            result.name, score.latency.median);
      }
    }
  }
  return [...times.values()];
}

function showWhatToPick(report) {
  const {results = []} = report;
  const figures = sequenceFigures.filter(({key}) => results.some(({quality}) => key in quality));
  if (!figures.length) return;
  $('what-to-pick').hidden = false;
  const times = timesOf(report);
  const chosen = () => ({time: times[$('pick-time').value], figure: figures[$('pick-figure').value]});
  fill($('pick-time'), times);
  fill($('pick-figure'), figures.map(({heading}) => ({label: heading})));
  const widest = times.reduce((best, {of}, index) => (of.size > times[best].of.size ? index : best), 0);
  if (times.length)
    $('pick-time').value = widest;
  else
    $('pick-time-label').hidden = $('pick-figure-label').hidden = $('pick-chart').hidden = true;

  // Those that no other beats in both; a tie does not beat.
  function unbeaten({time, figure}) {
    const of = (result) =>
        ({seconds: time?.of.get(result.name), value: (figure.most ? 1 : -1) * result.quality[figure.key]});
    const beats = (a, b) =>
        a.seconds <= b.seconds && a.value >= b.value && (a.seconds < b.seconds || a.value > b.value);
    return new Set(results.filter(
        (result) => of(result).seconds !== undefined && figure.key in result.quality &&
            !results.some((other) => beats(of(other), of(result)))));
  }

  function table() {
    const {time, figure} = chosen();
    const front = time ? unbeaten({time, figure}) : new Set();
    const best = (values, most) => (most ? Math.max : Math.min)(...values.filter((value) => value !== undefined));
    const columns = figures.map(
        (one) => ({...one, best: best(results.map(({quality}) => quality[one.key]), one.most).toFixed(one.decimals)}));
    const fastest = time && best([...time.of.values()], false);
    const cell = (text, isBest) => html('td', {class: `number${isBest ? ' best' : ''}`}, text);
    const rows =
        [...results]
            .sort((a, b) => (figure.most ? 1 : -1) * (b.quality[figure.key] - a.quality[figure.key]) || 0)
            .map((result) => {
              const seconds = time?.of.get(result.name);
              return html(
                  'tr', {}, html('th', {scope: 'row'}, swatch(result.color), result.name),
                  ...columns.map(({key, decimals, best: most}) => {
                    const text = result.quality[key]?.toFixed(decimals);
                    return cell(text ?? '–', text === most && results.length > 1);
                  }),
                  time &&
                      cell(
                          seconds === undefined ? '–' : milliseconds(seconds),
                          seconds === fastest && results.length > 1),
                  time &&
                      html(
                          'td', {},
                          front.has(result) ? html('span', {title: 'Nothing here is both faster and better'}, '●') :
                                              ''));
            });
    $('pick-table')
        .replaceChildren(
            html(
                'thead', {},
                html(
                    'tr', {}, html('th', {scope: 'col'}, 'Result'),
                    ...figures.map(
                        ({heading, unit}) =>
                            html('th', {scope: 'col', class: 'number'}, heading + (unit && ` (${unit.trim()})`))),
                    time && html('th', {scope: 'col', class: 'number'}, 'Time (ms)'),
                    time && html('th', {scope: 'col'}, html('span', {title: 'Not beaten'}, '●')))),
            html('tbody', {}, ...rows));
    $('pick-note').textContent = time ?
        `● No other result is both faster and better by ${figure.heading}. The best of a column in bold.` :
        'No times: upscale with --profile --report RESULT_DIR/report.json, or add what clarus bench writes.';
  }

  const redraw = chart($('pick-chart'), (width) => {
    const {time, figure} = chosen();
    const points =
        results.filter(({name, quality}) => time.of.has(name) && figure.key in quality)
            .map((result) => ({result, seconds: time.of.get(result.name), value: result.quality[figure.key]}));
    const height = 290, top = 24, bottom = height - 40, left = 52, right = width - 16;
    if (!points.length) return {height: 20, children: [label(0, 14, 'No result has this figure and a time.')]};
    const seconds = points.map((point) => point.seconds), values = points.map((point) => point.value);
    const slowest = Math.max(...seconds) * 1.6, least = Math.min(...seconds) / 1.6;
    const spread = Math.max(Math.max(...values) - Math.min(...values), 10 ** (1 - figure.decimals));
    const low = Math.min(...values) - 0.12 * spread, high = Math.max(...values) + 0.12 * spread;
    const x = logarithmic(least, slowest, left, right), y = linear(low, high, bottom, top);
    const {values: rows, decimals} = ticks(low, high, 5);
    const children = rows.flatMap(
        (value) =>
            [horizontal(y(value), left, right, 'grid'), label(left - 8, y(value) + 4, value.toFixed(decimals), 'end')]);
    for (const value of logTicks(least, slowest)) {
      children.push(
          vertical(x(value), top, bottom, 'grid'), label(x(value), bottom + 18, plain(value * 1e3), 'middle'));
    }
    children.push(
        label(right, height - 4, 'ms a frame', 'end'),
        label(
            0, 10,
            `${figure.heading}${figure.unit && ` (${figure.unit.trim()})`}, ${
                figure.most ? 'more' : 'less'} is better`));
    const front = unbeaten({time, figure});
    const steps = points.filter(({result}) => front.has(result)).sort((a, b) => a.seconds - b.seconds);
    if (steps.length > 1) children.push(path(steps.map((point) => [x(point.seconds), y(point.value)]), 'front'));
    for (const {result, seconds: at, value} of points) {
      const onLeft = x(at) > left + (right - left) * 0.7;
      children.push(
          svg('circle', {cx: x(at), cy: y(value), r: 6, style: `fill: ${result.color}`}),
          label(x(at) + (onLeft ? -11 : 11), y(value) + 4, result.name, onLeft ? 'end' : 'start', 'name'));
    }
    return {
      height,
      children,
      attributes: {role: 'img', 'aria-label': `${figure.heading} against time; the table below has the figures`}
    };
  });
  for (const id of ['pick-time', 'pick-figure'])
    $(id).addEventListener('change', () => {
      table();
      if (times.length) redraw();
    });
  table();
}
