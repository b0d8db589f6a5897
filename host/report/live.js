// Of a page that is served while results grow (clarus view): looks for the next one, and shows it at the same place.

const placeKey = 'clarus view';

function keepPlace(report) {
  const selects = [...document.querySelectorAll('select')]
                      .filter(({id, options}) => id && options.length)
                      .map(({id, selectedOptions: [option]}) => [id, option?.textContent]);
  sessionStorage.setItem(
      placeKey, JSON.stringify({selects, picture: report.picture?.(), scroll: [window.scrollX, window.scrollY]}));
}

function returnToPlace(report) {
  const kept = sessionStorage.getItem(placeKey);
  sessionStorage.removeItem(placeKey);
  if (!kept) return;
  const {selects, picture, scroll} = JSON.parse(kept);
  for (const [id, text] of selects) {
    const select = $(id), option = [...select.options].find(({textContent}) => textContent === text);
    if (!option || option.selected) continue;
    option.selected = true;
    select.dispatchEvent(new Event('change'));
  }
  if (picture) report.returnTo?.(picture);
  requestAnimationFrame(() => window.scrollTo(...scroll));
}

function follow(report) {
  returnToPlace(report);
  // Not under somebody's hands.
  const pause = 1000;
  let touched = -Infinity;
  for (const kind of ['pointerdown', 'pointermove', 'keydown', 'wheel'])
    addEventListener(kind, (event) => {
      if (kind !== 'pointermove' || event.buttons) touched = performance.now();
    }, {passive: true});
  const look = async () => {
    try {
      const answer = await fetch('version', {cache: 'no-store'});
      const isAnother = answer.ok && await answer.text() !== report.version;
      $('subtitle').classList.remove('lost');
      if (isAnother && !document.hidden && performance.now() - touched > pause) {
        keepPlace(report);
        location.reload();
        return;
      }
    } catch {  // The command has ended: what is shown stays.
      $('subtitle').classList.add('lost');
    }
    setTimeout(look, pause);
  };
  setTimeout(look, pause);
}
