import { readdirSync } from "node:fs";
import { join } from "node:path";

// Paths of all files below a folder whose names end so, in order.
export function files_below(folder, ending) {
  return readdirSync(folder, { recursive: true }).filter((name) => name.endsWith(ending)).sort().map((name) => join(folder, name));
}
