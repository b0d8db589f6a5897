// Reads the data and shows the sections that there is data for.

function colours(report) {
  const colors = new Map();
  report.colorOf = (name) => {
    if (!colors.has(name)) colors.set(name, seriesColor(colors.size));
    return colors.get(name);
  };
  for (const result of report.results ?? []) result.color = report.colorOf(result.name);
}

function showHeader(report) {
  const {title, frames, render_size, output_size, results = [], benches = []} = report;
  const devices = new Set([
    ...results.flatMap(({run}) => run?.devices.map(({name}) => name)),
    ...benches.flatMap(({bench}) => bench.devices.map(({profile}) => profile.name))
  ].filter(Boolean));
  const facts = [
    frames && `${frames.length} frames`,
    output_size && (render_size ? `${sizeText(render_size)} to ${sizeText(output_size)}` : sizeText(output_size)),
    ...devices,
  ];
  if (title) {
    $('title').textContent = title;
    document.title = `${title} – Clarus`;
  }
  $('subtitle').textContent =
      [...(title && !title.includes('Clarus') ? ['Clarus'] : []), ...facts.filter(Boolean)].join(' · ');
}

function showNavigation() {
  const sections = [...document.querySelectorAll('main > section:not([hidden])')];
  document.querySelector('nav').replaceChildren(
      ...sections.map((section) => html('a', {href: `#${section.id}`}, section.querySelector('h2').textContent)));
}

const report = JSON.parse($('data').textContent);
colours(report);
showHeader(report);
showPictures(report);
showWorst(report);
showQualityOverTime(report);
showWhatToPick(report);
showStages(report);
showTimeline(report);
showRoofline(report);
showDevices(report);
showNavigation();
if (report.version) follow(report);
