// How near kernels come to what the device can do: operations a second against operations a byte. Kernels without
// arithmetic have no place there; they stand on its left, at their bytes a second.

// A device's name with the peaks that were measured there, where they were.
function peaksOf(report) {
  const peaks = new Map();
  for (const {name, bench} of report.benches ?? []) {
    for (const {profile, compute_peak, copy_bandwidth} of bench.devices) {
      peaks.set(deviceLabel(report, name, profile), {compute: compute_peak.median, bandwidth: copy_bandwidth.median});
    }
  }
  return peaks;
}

function showRoofline(report) {
  const peaks = peaksOf(report);
  const hasPoint = ({bytes, seconds}) => bytes > 0 && seconds > 0;
  const profiles = profilesOf(report).filter(({stages}) => stages.some(hasPoint));
  const devices = [...new Set(profiles.map(({device}) => device))].sort((a, b) => peaks.has(b) - peaks.has(a));
  if (!devices.length) return;
  $('roofline').hidden = false;
  fill($('roofline-device'), devices.map((device) => ({label: device})));
  const device = () => devices[$('roofline-device').value];
  let shown = [], points = [], current = 0;

  const pointsOf = (profile) => profile.stages.filter(hasPoint).map((stage) => ({
                                                                      profile,
                                                                      stage,
                                                                      intensity: stage.operations / stage.bytes,
                                                                      rate: stage.operations / stage.seconds,
                                                                      bandwidth: stage.bytes / stage.seconds
                                                                    }));
  function note(chosen) {
    const stages = chosen.flatMap(({stages}) => stages);
    const without = new Set(stages.filter((stage) => !hasPoint(stage)).map(({name}) => name));
    const ofOthers = [
      ['fp16', ({precision}) => precision === 'fp16'], ['bf16', ({precision}) => precision === 'bf16'],
      ['int8', ({stages}) => stages.some(({kernel}) => kernel?.startsWith('int8'))]
    ].filter(([, has]) => chosen.some(has)).map(([name]) => name);
    $('roofline-note').textContent = [
      peaks.has(device()) ?
          'Roofs as measured: multiply-adds in registers, and one large copy. A dot above them does with fewer ' +
              'operations than the plain definition counts, or finds its data in caches.' :
          'Without the device\'s roofs: clarus bench measures them.',
      peaks.has(device()) && ofOthers.length &&
          `The compute roof is single precision's, for ${ofOthers.join(', ')} too.`,
      without.size && `Not drawn, for want of a time or a count of bytes: ${[...without].join(', ')}.`,
      'A dot\'s area is its time. ← → go through the kernels, the longest first.'
    ].filter(Boolean).join(' ');
  }
  function choose() {
    const choice = shown[$('roofline-of').value].profile;
    const chosen = choice ? [choice] : shown.slice(1).map(({profile}) => profile);
    points = chosen.flatMap(pointsOf).sort((a, b) => b.stage.seconds - a.stage.seconds);
    note(chosen);
    select(0);
  }
  function chooseDevice() {
    shown = [
      {label: 'all'},
      ...profiles.filter((profile) => profile.device === device())
          .map((profile) => ({label: profile.label, group: profile.group, profile}))
    ];
    $('roofline-of').replaceChildren();
    fill($('roofline-of'), shown);
    choose();
  }
  function select(index) {
    current = (index + points.length) % points.length;
    const {profile, stage, intensity, rate, bandwidth} = points[current];
    const peak = peaks.get(device());
    const what = rate ? `${gigas(rate)} GFLOP/s at ${digits(intensity)} FLOP/byte` :
                        `${gigas(bandwidth)} GB/s without arithmetic`;
    // Of the lower of the two roofs.
    const share = peak && `, ${percent(Math.max(rate / peak.compute, bandwidth / peak.bandwidth))} of the roof`;
    $('roofline-readout')
        .replaceChildren(
            html('span', {}, swatch(profile.color), stage.name, ' ', html('span', {class: 'muted'}, stage.kernel)),
            html('span', {class: 'muted'}, profile.label),
            html('span', {}, `${milliseconds(stage.seconds)} ms, ${what}${share ?? ''}`));
    redraw();
  }
  const redraw = chart($('roofline-chart'), (width) => {
    const peak = peaks.get(device());
    const computing = points.filter(({rate}) => rate > 0), moving = points.filter(({rate}) => !rate);
    const corners = [...computing, ...(peak ? [{intensity: peak.compute / peak.bandwidth, rate: peak.compute}] : [])];
    const height = Math.min(420, Math.max(280, width * 0.5)), top = 24, bottom = height - 40, margin = 52,
          right = width - 12;
    const strip = moving.length && {left: margin, right: corners.length ? margin + Math.max(64, width * 0.1) : right};
    const left = (strip ? strip.right : 0) + margin;

    const intensities = corners.map(({intensity}) => intensity);
    const low = corners.length ? Math.min(...intensities) / 1.8 : 1, high = Math.max(...intensities) * 1.8;
    // The strip goes on where the plot ends: its bytes a second are at the height that they have at the plot's left
    // edge.
    const bandwidths = strip ? [...moving.map(({bandwidth}) => bandwidth), ...(peak ? [peak.bandwidth] : [])] : [];
    const rates = [...corners.map(({rate}) => rate), ...bandwidths.map((bandwidth) => bandwidth * low)];
    const least = Math.min(...rates) / 1.8, most = Math.max(...rates) * 1.8;
    const x = logarithmic(low, high, left, right), y = logarithmic(least, most, bottom, top);
    const children = [];
    const rows = (values, place, from, to) => values.forEach((value) => {
      children.push(
          horizontal(place(value), from, to, 'grid'), label(from - 8, place(value) + 4, plain(value * 1e-9), 'end'));
    });
    if (strip) {
      const across = (bandwidth) => y(bandwidth * low);
      rows(logTicks(least / low, most / low), across, strip.left, strip.right);
      children.push(
          label(0, 10, 'GB/s'), label((strip.left + strip.right) / 2, bottom + 18, 'no arithmetic', 'middle'));
      if (peak)
        children.push(path([[strip.left, across(peak.bandwidth)], [strip.right, across(peak.bandwidth)]], 'roof'));
    }
    if (corners.length) {
      for (const value of logTicks(low, high))
        children.push(vertical(x(value), top, bottom, 'grid'), label(x(value), bottom + 18, plain(value), 'middle'));
      rows(logTicks(least, most), y, left, right);
      children.push(label(right, height - 4, 'FLOP/byte', 'end'), label(left - margin, 10, 'GFLOP/s'));
    }
    if (peak) {
      const ridge = peak.compute / peak.bandwidth, start = Math.max(low, least / peak.bandwidth);
      children.push(
          path([[x(start), y(peak.bandwidth * start)], [x(ridge), y(peak.compute)], [right, y(peak.compute)]], 'roof'),
          label(right, y(peak.compute) - 6, `${gigas(peak.compute)} GFLOP/s`, 'end', 'name'),
          svg('text', {
            x: x(start) + 6,
            y: y(peak.bandwidth * start) - 8,
            class: 'name',
            transform: `rotate(${
                (Math.atan2(y(peak.compute) - y(peak.bandwidth * start), x(ridge) - x(start)) * 180) /
                Math.PI} ${x(start)} ${y(peak.bandwidth * start)})`
          },
              `${gigas(peak.bandwidth)} GB/s`));
    }

    const longest = points[0].stage.seconds;
    const radius = ({stage}) => Math.max(3, 12 * Math.sqrt(stage.seconds / longest));
    const beside = (point) => strip.left + ((moving.indexOf(point) + 0.5) / moving.length) * (strip.right - strip.left);
    const places = points.map(
        (point) => point.rate ? [x(point.intensity), y(point.rate)] : [beside(point), y(point.bandwidth * low)]);
    points.forEach((point, index) => {
      const [cx, cy] = places[index];
      children.push(
          svg('circle', {cx, cy, r: radius(point), style: `fill: ${point.profile.color}; fill-opacity: 0.7`}));
    });
    const [cx, cy] = places[current];
    children.push(svg('circle', {cx, cy, r: radius(points[current]) + 3, class: 'ring'}));
    const distance = ([pointX, pointY], atX, atY) => Math.hypot(pointX - atX, pointY - atY);
    return {
      height,
      children,
      attributes: {
        tabindex: 0,
        role: 'group',
        'aria-label': 'Operations a second of every kernel against operations a byte, and bytes a second of those ' +
            'without arithmetic; left and right keys go through them'
      },
      listeners: browsing({
        nearest: (atX, atY) => places.reduce(
            (best, place, index) => (distance(place, atX, atY) < distance(places[best], atX, atY) ? index : best), 0),
        current,
        count: points.length,
        go: select
      }),
    };
  });
  $('roofline-device').addEventListener('change', chooseDevice);
  $('roofline-of').addEventListener('change', choose);
  chooseDevice();
}
