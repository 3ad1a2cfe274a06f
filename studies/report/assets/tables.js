"use strict";
// Buttons above each table: copy it, or save it as CSV.

report.tables = (() => {
  const { element } = report;

  function cells(table) {
    return [...table.rows].map((row) => [...row.cells].map((cell) => cell.dataset.value || cell.textContent.trim()));
  }

  function quoted(text) {
    // a spreadsheet would run a cell that begins so; a number may begin with a sign
    const safe = /^[=+\-@\t]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
    return /[",\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  }

  const csv = (table) => cells(table).map((row) => row.map(quoted).join(",")).join("\r\n") + "\r\n";
  const tabbed = (table) => cells(table).map((row) => row.join("\t")).join("\n");

  async function copy(text, button) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // a page from a disk may have no clipboard
      const area = element("textarea", { class: "aside" });
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    const before = button.textContent;
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = before; }, 1500);
  }

  function save(text, name) {
    const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: "text/csv" })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  function start() {
    for (const box of document.querySelectorAll("div.table")) {
      const table = box.querySelector("table");
      const name = table.caption ? table.caption.textContent : "table";
      const bar = element("div", { class: "buttons" },
        element("button", { type: "button", "aria-label": `Copy: ${name}`, onclick: (event) => copy(tabbed(table), event.target) }, "Copy"),
        element("button", { type: "button", "aria-label": `Save as CSV: ${name}`, onclick: () => save(csv(table), `${box.dataset.file}.csv`) }, "CSV"));
      box.prepend(bar);
    }
    for (const button of document.querySelectorAll("button[data-copies]")) {
      button.hidden = false;
      button.addEventListener("click", () => copy(document.getElementById(button.dataset.copies).textContent, button));
    }
  }
  return { start, csv, tabbed };
})();
