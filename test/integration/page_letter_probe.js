// Runs at the end of a copy of map.html: looks at the map from the front and from above in each
// colouring, and leaves in the element "measured" what is drawn, as PNG, and the bar beside it.
const measured = {views: []};
for (const id of ["path", "frusta", "shading"]) element(id).click();
for (const view of ["front", "top"]) {
  document.querySelector(`[data-look=${view}]`).click();
  for (const colour of ["height", "confidence", "support", "time"]) {
    element("colour").value = colour;
    element("colour").dispatchEvent(new Event("change", {bubbles: true}));
    draw();
    const bar = getComputedStyle(element("legend-bar")).backgroundImage;
    const ends = ["legend-low", "legend-high"].map(element).sort(
      (a, b) => a.getBoundingClientRect().left - b.getBoundingClientRect().left);
    measured.views.push({view, colour, picture: canvas.toDataURL("image/png").split(",")[1],
      direction: bar.split(",")[0], low: ends[0].textContent, high: ends[1].textContent,
      bar: bar.match(/\d+, \d+, \d+/g).map(text => text.split(", ").map(Number))});
  }
}
measured.problems = problems;
const result = document.body.appendChild(document.createElement("pre"));
result.id = "measured";
result.textContent = JSON.stringify(measured);
