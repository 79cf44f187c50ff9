(() => {
  "use strict";
  const most = 20;
  const box = document.querySelector(".search"), field = box.querySelector("input");
  const list = box.querySelector("ol"), count = box.querySelector("output");
  box.hidden = false;

  const open = element => {
    for (let e = element; e; e = e.parentElement) if (e.nodeName === "DETAILS") e.open = true;
  };
  const show = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target) { open(target); target.scrollIntoView(); }
  };
  window.addEventListener("hashchange", show);
  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(d => { d.open = true; }));
  show();

  let entries;  // read when first asked for: claims, figures, tables and parts, with formulas also as they are typed
  const plain = text => text.toLowerCase().replace(/\s+/g, " ");
  const read = () => [...document.querySelectorAll("[data-find]")].map(element => ({
    id: element.id, label: element.dataset.find,
    text: plain([element.textContent, ...[...element.querySelectorAll("math")].map(m => m.getAttribute("alttext"))].join(" ")),
  }));
  const find = () => {
    const words = plain(field.value).split(" ").filter(Boolean);
    entries ??= read();
    const found = words.length ? entries.filter(entry => words.every(word => entry.text.includes(word))) : [];
    list.replaceChildren(...found.slice(0, most).map(entry => {
      const item = document.createElement("li"), link = document.createElement("a");
      link.href = `#${entry.id}`;
      link.textContent = entry.label;
      link.addEventListener("click", () => { open(document.getElementById(entry.id)); list.replaceChildren(); count.value = ""; });
      item.append(link);
      return item;
    }));
    count.value = !words.length ? "" : found.length > most ? `${found.length} places, the first ${most}` : `${found.length} places`;
  };
  field.addEventListener("input", find);
  field.addEventListener("keydown", event => {
    if (event.key === "Escape") { field.value = ""; find(); }
    if (event.key === "Enter") list.querySelector("a")?.click();
  });
})();
