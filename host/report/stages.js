// Kernels and their time.

// Everything that has stages:
// {label, group, device, precision, color, stages: [{name, kernel, seconds, operations, bytes}]}.
function profilesOf(report) {
  const profiles = [];
  for (const {name, run} of report.results ?? []) {
    if (!run?.stages?.length) continue;
    profiles.push({
      label: `${name}, ${sizeText(run.output_size)}, ${run.precision}`,
      group: `These results on ${deviceNames(run)}`,
      device: deviceNames(run),
      precision: run.precision,
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
          precision,
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
    const several = new Set(stages.map(({device}) => device)).size > 1;
    const whose = ({device}) => several && html('span', {class: 'kernel'}, device < 0 ? '' : `device ${device}`);
    const most = Math.max(...stages.map(({seconds}) => seconds)) || 1;
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
                    row('stage', [stage.name, html('span', {class: 'kernel'}, stage.kernel), whose(stage) || ''], bar(stage.seconds),
                        time(stage), percent(stage.seconds / (total || 1)), rate(stage.operations, stage.seconds),
                        rate(stage.bytes, stage.seconds))),
            row('stage total', 'Sum', '', milliseconds(total), '', rate(sum('operations'), total),
                rate(sum('bytes'), total)));
  }
  $('stages-of').addEventListener('change', update);
  update();
}
