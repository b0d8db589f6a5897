// Kernels: their time, and how near they come to what the device can do.

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

// Everything that has stages: {label, group, device, color, stages: [{name, kernel, seconds, operations, bytes}]}.
function profilesOf(report) {
  const profiles = [];
  for (const {name, run} of report.results ?? []) {
    if (!run?.stages?.length) continue;
    profiles.push({
      label: `${name}, ${sizeText(run.output_size)}, ${run.precision}`,
      group: `These results on ${run.device.name}`,
      device: run.device.name,
      color: report.colorOf(name),
      stages: run.stages
    });
  }
  for (const {name: file, bench} of report.benches ?? []) {
    for (const {profile} of bench.devices) {
      for (const {device, model, output_size, precision, score} of bench.items) {
        if (!score || device !== profile.selector) continue;
        profiles.push({
          label: `${model.name}, ${sizeText(output_size)}, ${precision}`,
          group: `${file}: ${profile.name}`,
          device: deviceLabel(report, file, profile),
          color: report.colorOf(model.name),
          stages: score.stages.map((stage) => ({...stage, seconds: stage.seconds.median, interval: stage.seconds}))
        });
      }
    }
  }
  return profiles;
}

function showStages(report) {
  const profiles = profilesOf(report);
  if (!profiles.length) return;
  $('stages').hidden = false;
  fill($('stages-of'), profiles);
  const longest =
      profiles.reduce((best, {stages}, index) => (stages.length > profiles[best].stages.length ? index : best), 0);
  $('stages-of').value = longest;

  const row = (kind, ...cells) =>
      html('div', {class: kind, role: 'row'}, ...cells.map((cell) => html('span', {role: 'cell'}, ...[cell].flat())));
  function update() {
    const {stages, color} = profiles[$('stages-of').value];
    const total = stages.reduce((sum, {seconds}) => sum + seconds, 0);
    const most = Math.max(...stages.map(({seconds}) => seconds));
    const rate = (amount, seconds) => (amount > 0 && seconds > 0 ? gigas(amount / seconds) : '–');
    const bar = (seconds) => {
      const box =
          html('span', {class: 'bar'}, html('i', {style: `width: ${(seconds / most) * 100}%; background: ${color}`}));
      box.style.display = 'block';
      return box;
    };
    const time = ({seconds, interval}) => html(
        'span', interval && {title: `${milliseconds(interval.low)} to ${milliseconds(interval.high)} ms`},
        milliseconds(seconds));
    const sum = (key) => stages.reduce((all, stage) => all + stage[key], 0);
    $('stage-bars').setAttribute('role', 'table');
    $('stage-bars')
        .replaceChildren(
            row('stage-head', 'Stage', '', 'ms', '', 'GFLOP/s', 'GB/s'),
            ...stages.map(
                (stage) =>
                    row('stage', [stage.name, html('span', {class: 'kernel'}, stage.kernel)], bar(stage.seconds),
                        time(stage), percent(stage.seconds / total), rate(stage.operations, stage.seconds),
                        rate(stage.bytes, stage.seconds))),
            row('stage total', 'Sum', '', milliseconds(total), '', rate(sum('operations'), total),
                rate(sum('bytes'), total)));
  }
  $('stages-of').addEventListener('change', update);
  update();
}

function showRoofline(report) {
  const profiles = profilesOf(report);
  const peaks = peaksOf(report);
  const hasPoint = ({operations, bytes, seconds}) => operations > 0 && bytes > 0 && seconds > 0;
  const devices = [...new Set(profiles.filter(({stages}) => stages.some(hasPoint)).map(({device}) => device))].sort(
      (a, b) => peaks.has(b) - peaks.has(a));
  if (!devices.length) return;
  $('roofline').hidden = false;
  fill($('roofline-device'), devices.map((device) => ({label: device})));
  const device = () => devices[$('roofline-device').value];
  let shown = [], points = [], current = 0;

  function choose() {
    const choice = shown[$('roofline-of').value]?.profile;
    points = (choice ? [choice] : shown.slice(1).map(({profile}) => profile))
                 .flatMap((profile) => profile.stages.filter(hasPoint).map((stage) => ({
                                                                             profile,
                                                                             stage,
                                                                             intensity: stage.operations / stage.bytes,
                                                                             rate: stage.operations / stage.seconds
                                                                           })))
                 .sort((a, b) => b.stage.seconds - a.stage.seconds);
    current = 0;
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
    const roofs = peaks.has(device()) ?
        'Roofs as measured: multiply-adds in registers, and one large copy. A dot above them does with fewer ' +
            'operations than the plain definition counts, or finds its data in caches.' :
        'Without the device\'s roofs: clarus bench measures them.';
    $('roofline-note').textContent =
        `${roofs} A dot's area is its time. ← → go through the kernels, the longest first.`;
    choose();
  }
  const roofAt = (intensity) => {
    const peak = peaks.get(device());
    return peak && Math.min(peak.compute, peak.bandwidth * intensity);
  };
  function select(index) {
    current = (index + points.length) % points.length;
    const {profile, stage, intensity, rate} = points[current];
    const roof = roofAt(intensity);
    $('roofline-readout')
        .replaceChildren(
            html('span', {}, swatch(profile.color), stage.name, ' ', html('span', {class: 'muted'}, stage.kernel)),
            html('span', {class: 'muted'}, profile.label),
            html(
                'span', {},
                `${milliseconds(stage.seconds)} ms, ${gigas(rate)} GFLOP/s at ${digits(intensity)} FLOP/byte${
                    roof ? `, ${percent(rate / roof)} of the roof` : ''}`));
    redraw();
  }
  const redraw = chart($('roofline-chart'), (width) => {
    const peak = peaks.get(device());
    const height = Math.min(420, Math.max(280, width * 0.5)), top = 24, bottom = height - 40, left = 52,
          right = width - 12;
    const intensities = points.map((point) => point.intensity).concat(peak ? [peak.compute / peak.bandwidth] : []);
    const rates = points.map((point) => point.rate).concat(peak ? [peak.compute] : []);
    const low = Math.min(...intensities) / 1.8, high = Math.max(...intensities) * 1.8;
    const least = Math.min(...rates) / 1.8, most = Math.max(...rates) * 1.8;
    const x = logarithmic(low, high, left, right), y = logarithmic(least, most, bottom, top);
    const children = [];
    for (const value of logTicks(low, high))
      children.push(vertical(x(value), top, bottom, 'grid'), label(x(value), bottom + 18, plain(value), 'middle'));
    for (const value of logTicks(least, most))
      children.push(
          horizontal(y(value), left, right, 'grid'), label(left - 8, y(value) + 4, plain(value * 1e-9), 'end'));
    children.push(label(right, height - 4, 'FLOP/byte', 'end'), label(0, 10, 'GFLOP/s'));
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
    for (const point of points) {
      children.push(svg('circle', {
        cx: x(point.intensity),
        cy: y(point.rate),
        r: radius(point),
        style: `fill: ${point.profile.color}; fill-opacity: 0.7`
      }));
    }
    children.push(svg('circle', {
      cx: x(points[current].intensity),
      cy: y(points[current].rate),
      r: radius(points[current]) + 3,
      class: 'ring'
    }));
    const nearest = (event) => {
      const box = event.currentTarget.getBoundingClientRect();
      const distance = (point) =>
          Math.hypot(x(point.intensity) - (event.clientX - box.left), y(point.rate) - (event.clientY - box.top));
      return points.reduce((best, point, index) => (distance(point) < distance(points[best]) ? index : best), 0);
    };
    return {
      height,
      children,
      attributes: {
        tabindex: 0,
        role: 'group',
        'aria-label':
            'Operations a second of every kernel against operations a byte; left and right keys go through them'
      },
      listeners: {
        pointermove: (event) => {
          const index = nearest(event);
          if (index !== current) select(index);
        },
        keydown: (event) => {
          const steps = {ArrowLeft: -1, ArrowRight: 1};
          if (!(event.key in steps)) return;
          event.preventDefault();
          select(current + steps[event.key]);
        },
      },
    };
  });
  $('roofline-device').addEventListener('change', chooseDevice);
  $('roofline-of').addEventListener('change', choose);
  chooseDevice();
}
