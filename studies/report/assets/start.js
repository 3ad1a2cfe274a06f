"use strict";
// The page without its script is complete; with it, pictures give way to what moves.

document.documentElement.classList.add("js");
report.tables.start();
report.motion.start();
report.charts.start();
document.documentElement.dataset.ready = performance.now().toFixed(1);
