/** Search for Swagger UI, whose own filter looks at tags alone. */

/** Part of an Immutable.js collection, in which Swagger UI holds the operations of each tag. */
interface Collection {
  get(name: string): unknown;
  getIn(path: readonly string[]): unknown;
  map(change: (tag: Collection) => Collection): Collection;
  filter(keep: (entry: Collection) => boolean): Collection;
  set(name: string, value: unknown): Collection;
  readonly size: number;
}

/** The operations whose method, path, id, summary or description has every word of the phrase. */
export function filtered(tags: Collection, phrase: string): Collection {
  const words = phrase.toLowerCase().split(/\s+/);
  const fits = (operation: Collection) => {
    const texts = ["operationId", "summary", "description"].map((name) =>
      operation.getIn(["operation", name]),
    );
    const text = [operation.get("method"), operation.get("path"), ...texts].join(" ").toLowerCase();
    return words.every((word) => text.includes(word));
  };
  return tags
    .map((tag) => tag.set("operations", (tag.get("operations") as Collection).filter(fits)))
    .filter((tag) => (tag.get("operations") as Collection).size > 0);
}
