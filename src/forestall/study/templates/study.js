"use strict";
{
  const form = document.getElementById("answer");
  const began = performance.now();
  let sent = false;
  form.addEventListener("submit", (event) => {
    if (sent) { event.preventDefault(); return; }
    sent = true;
    form.elements.seconds.value = ((performance.now() - began) / 1000).toFixed(1);
  });
  window.addEventListener("pageshow", (event) => { if (event.persisted) sent = false; });
  const keys = { a: "a", b: "b", s: "both" };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (event.key === "Backspace") {
      const back = document.getElementById("back");
      if (back) { event.preventDefault(); back.click(); }
      return;
    }
    const choice = keys[event.key.toLowerCase()];
    if (choice) form.querySelector(`button[value="${choice}"]`).click();
  });
}
