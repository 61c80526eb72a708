// A list is narrowed in the page, while one types: it needs no answer of the studio, and nothing moves under a click
// once it has come.  list: selector; its items have data-text, and data-purposes where change has a purpose (a number).
function narrow(list, change) {
  const box = document.querySelector(list);
  const { text, purpose } = Object.assign((box.asked ??= {}), change);
  const words = (text ?? "").toLowerCase().split(/\s+/).filter(Boolean);
  const items = [...box.querySelectorAll("[data-text]")];
  for (const item of items) {
    const { text: own, purposes } = item.dataset;
    const wanted = purpose === undefined || purposes.split(" ").includes(`${purpose}`);
    item.hidden = !wanted || !words.every((word) => own.includes(word));
  }
  const count = document.querySelector(`[data-counts="${list}"]`);
  if (count) count.textContent = count.dataset.said.replace("#", items.filter((item) => !item.hidden).length);
}
