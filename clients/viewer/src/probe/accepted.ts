/** Names of the files that are taken; apart from the readers, which only the worker needs. */

export const NAMES = "BVH, GLB, glTF or USD";
/** What the button lets one choose. */
export const ACCEPTED = ".bvh,.glb,.gltf,.bin,.usd,.usda,.usdc,.usdz";

/** The files of which something is to be said; buffers of .gltf files are parts of them. */
export function toReport(files: readonly File[]): File[] {
  const found = files.filter(({ name }) => suffixOf(name) !== ".bin");
  return found.length ? found : [...files];
}

export function suffixOf(name: string): string {
  const at = name.lastIndexOf(".");
  return at > 0 ? name.slice(at).toLowerCase() : "";
}
