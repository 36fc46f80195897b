/** Names for the fields that Swagger UI draws without a label, for screen readers. */

/** Name all fields below an element, and those that appear there later. */
export function nameFields(root: Element): void {
  const observer = new MutationObserver(() => {
    for (const field of root.querySelectorAll("select, input, textarea"))
      if (!field.hasAttribute("aria-label")) name(field);
  });
  observer.observe(root, { childList: true, subtree: true });
}

function name(field: Element): void {
  if (field.matches(".operation-filter-input")) {
    field.setAttribute("aria-label", "Search operations");
    // Swagger UI says "Filter by tag".
    field.setAttribute("placeholder", "Search operations");
    return;
  }
  const parameter = field.closest("[data-param-name]")?.getAttribute("data-param-name");
  const words = field.matches("#servers") ? "Server" : (parameter ?? FIELDS.get(field.className));
  if (words) field.setAttribute("aria-label", words);
}

const FIELDS = new Map([
  ["body-param__text", "Request body"],
  ["content-type", "Media type"],
]);
