"use strict";
const sections = [...document.querySelectorAll("section[data-number]")];
const output = document.getElementById("command");

function decisions() {
  const found = { accept: [], reject: [], merge: [], drop: [] };
  for (const section of sections) {
    const number = Number(section.dataset.number);
    const into = section.querySelector("select").value;
    const choice = section.querySelector("input[type=radio]:checked").value;
    if (into) found.merge.push([Number(into), number]);
    else if (choice) found[choice].push(number);
    for (const box of section.querySelectorAll("input[name=drop]:checked")) found.drop.push(box.value);
  }
  return found;
}

// A word of a shell command: quoted where it has other characters than names of files have.
function word(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;
}

function command(found) {
  const words = ["posefield", "review", output.dataset.folder];
  if (found.accept.length) words.push("--accept", found.accept.join(","));
  if (found.reject.length) words.push("--reject", found.reject.join(","));
  for (const pair of found.merge) words.push("--merge", pair.join(","));
  for (const clip of found.drop) words.push("--drop", clip);
  return words.length > 3 ? words.map(word).join(" ") : "No decision yet.";
}

function show() {
  for (const section of sections) {
    const merged = section.querySelector("select").value !== "";
    const choice = section.querySelector("input[type=radio]:checked").value;
    for (const radio of section.querySelectorAll("input[type=radio]")) radio.disabled = merged;
    section.className = merged ? "merged" : choice;
  }
  output.value = command(decisions());
}

document.addEventListener("change", show);
document.getElementById("save").addEventListener("click", () => {
  const link = document.createElement("a");
  const text = `${JSON.stringify(decisions(), null, 2)}\n`;
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = "decisions.json";
  link.click();
  URL.revokeObjectURL(link.href);
});
show();
