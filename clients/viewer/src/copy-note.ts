/** How far the answers of a copy without a service can be relied on. */

import { el } from "./dom.ts";
import type { Mount } from "./page.ts";

export const mount: Mount = (host, { source }) => {
  host.hidden = !source.remark;
  if (source.remark) host.append(el("p", { class: "about", role: "note" }, source.remark));
};
