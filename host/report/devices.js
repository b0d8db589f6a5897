// What `clarus bench` measured, devices side by side.

// A device's name, with its file and selector where there are several of that name.
function deviceLabel(report, file, profile) {
  const devices = report.benches.flatMap(({bench}) => bench.devices);
  const alone = devices.filter((device) => device.profile.name === profile.name).length === 1;
  return alone ? profile.name : `${profile.name} (${file}, ${profile.selector})`;
}

function showDevices(report) {
  const benches = report.benches ?? [];
  if (!benches.length) return;
  $('devices').hidden = false;
  const columns = benches.flatMap(
      ({name, bench}) => bench.devices.map((device) => ({file: name, bench, device, profile: device.profile})));
  const head = (first) => html(
      'thead', {},
      html(
          'tr', {}, html('th', {scope: 'col'}, first),
          ...columns.map(
              ({file, profile}) => html(
                  'th', {scope: 'col'}, profile.name, html('br'), html('small', {}, `${file}, ${profile.selector}`)))));

  const figure = (scale, unit) => ({median, low, high}) =>
      `${digits(median * scale)} ${unit} (${digits(low * scale)}–${digits(high * scale)})`;
  const facts = [
    ['Platform', ({device}) => device.platform_version],
    ['Driver', ({profile}) => profile.driver_version],
    ['OpenCL', ({profile, device}) => `${profile.opencl_version}; ${device.opencl_c_version}`],
    ['Units', ({profile}) => `${profile.compute_units} at ${profile.clock_mhz} MHz, ${profile.class}`],
    ['Memory', ({profile}) => `${(profile.global_memory / 2 ** 30).toFixed(1)} GiB`],
    ['Half',
     ({profile}) =>
         (profile.half_arithmetic  ? 'stored and computed' :
              profile.half_storage ? 'stored' :
                                     'no')],
    ['Compute peak', ({device}) => figure(1e-9, 'GFLOP/s')(device.compute_peak)],
    ['Compute peak of bytes', ({device}) => (device.int8_peak ? figure(1e-9, 'GOP/s')(device.int8_peak) : '–')],
    ['Copy bandwidth', ({device}) => figure(1e-9, 'GB/s')(device.copy_bandwidth)],
    [
      'Host',
      ({bench}) => [bench.host.cpu, `${bench.host.cores} cores`, bench.host.os, bench.host.kernel].filter(Boolean).join(
          ', ')
    ],
    [
      'Governor, clock',
      ({bench}) =>
          [bench.host.governor ?? 'hidden',
           bench.host.clock_mhz.some((clock) => clock !== null) &&
               `${bench.host.clock_mhz.map((clock) => (clock === null ? '–' : clock.toFixed(0))).join(' to ')} MHz`]
              .filter(Boolean)
              .join(', ')
    ],
    ['Load before', ({bench}) => bench.host.load_average?.toFixed(2) ?? '–'],
    [
      'Measured',
      ({bench}) => `${bench.date.replace('T', ' ').replace('Z', ' UTC')}, ${bench.suite.profile}, Clarus ${
          bench.suite.version}${bench.suite.commit ? ` (${bench.suite.commit})` : ''}`
    ],
  ];
  $('device-facts').classList.add('facts');
  $('device-facts')
      .replaceChildren(
          head('Device'),
          html(
              'tbody', {},
              ...facts.map(
                  ([name, of]) => html(
                      'tr', {}, html('th', {scope: 'row'}, name),
                      ...columns.map((column) => html('td', {}, of(column)))))));

  const keyOf = ({model, output_size, precision}) => [model.name, ...output_size, precision].join(' ');
  const rows = new Map();
  columns.forEach(({bench, profile}, index) => {
    for (const item of bench.items) {
      if (item.device !== profile.selector) continue;
      if (!rows.has(keyOf(item))) rows.set(keyOf(item), {item, cells: []});
      rows.get(keyOf(item)).cells[index] = item;
    }
  });
  const what =
      ({model,
        output_size,
        precision}) => [model.name, html('br'), html('small', {}, `${sizeText(output_size)}, ${precision}`)];
  const bySize = ({item: a}, {item: b}) => a.output_size[0] * a.output_size[1] - b.output_size[0] * b.output_size[1];
  $('device-times')
      .replaceChildren(head('Model'), html('tbody', {}, ...[...rows.values()].sort(bySize).map(({item, cells}) => {
                         const medians =
                             cells.map((cell) => cell?.score?.latency.median).filter((median) => median !== undefined);
                         const fastest = Math.min(...medians), several = medians.length > 1;
                         return html('tr', {}, html('th', {scope: 'row'}, ...what(item)), ...columns.map((_, index) => {
                           const cell = cells[index];
                           if (!cell) return html('td', {}, '–');
                           if (!cell.score) return html('td', {}, html('small', {}, `no score: ${cell.no_score}`));
                           const {latency, frames_per_second: rate} = cell.score;
                           const details = `${digits(rate.median)} fps${
                               latency.median > fastest ? `, ${digits(latency.median / fastest)} times as long` : ''}`;
                           return html(
                               'td', {class: 'number'},
                               html(
                                   'span', {class: several && latency.median === fastest ? 'best' : undefined},
                                   `${milliseconds(latency.median)} ms`),
                               html(
                                   'span', {class: 'muted'},
                                   ` (${milliseconds(latency.low)}–${milliseconds(latency.high)})${
                                       latency.steady ? '' : ' unsteady'}`),
                               html('br'), html('small', {}, details));
                         }));
                       })));

  const dash = (value, format) => (value === null || value === undefined ? '–' : format(value));
  const headings = [
    'Model', 'Median (ms)', 'p95', 'p99', 'Frames/s', 'Device (ms)', 'Of roofline', 'GFLOP', 'Memory', 'Cold start (s)',
    'Warm (s)', 'Other size (s)', 'Output'
  ];
  $('device-items')
      .replaceChildren(
          html(
              'thead', {},
              html(
                  'tr', {},
                  ...headings.map(
                      (heading, index) => html('th', {scope: 'col', class: index ? 'number' : 'text'}, heading)))),
          ...columns.map(
              ({file, bench, profile}) => html(
                  'tbody', {},
                  columns.length > 1 ?
                      html(
                          'tr', {},
                          html('th', {scope: 'rowgroup', colspan: headings.length}, `${profile.name} (${file})`)) :
                      null,
                  ...bench.items.filter(({device}) => device === profile.selector)
                      .map(({score, start, memory, check, no_score, ...item}) => {
                        const cells = [
                          dash(score?.latency.median, milliseconds), dash(score?.latency.p95, milliseconds),
                          dash(score?.latency.p99, milliseconds), dash(score?.frames_per_second.median, digits),
                          dash(score?.device_seconds.median, milliseconds), dash(score?.roofline_share, percent),
                          dash(score?.operations, gigas), dash(memory?.total, mebibytes),
                          dash(start?.cold_seconds, digits), dash(start?.warm_seconds, digits),
                          dash(start?.other_size_seconds, digits)
                        ];
                        return html(
                            'tr', {}, html('th', {scope: 'row'}, ...what(item)),
                            ...cells.map((cell) => html('td', {class: 'number'}, cell)),
                            html('td', {title: no_score ?? check.reason}, check.result));
                      }))));
}
