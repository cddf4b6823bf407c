// Each snippet with the driver that the test needs, as modules that a browser loads.
import { writeFileSync } from "node:fs";
import { build } from "esbuild";

// The driver only gets what the snippet itself names: nothing of the snippet is changed.
function entry({ snippet, driver, names }) {
  return `${snippet}\nimport { drive } from "../drivers/${driver}";\nglobalThis.client = drive({ ${names.join(", ")} });\n`;
}

// Writes FOLDER/out/NAME.js (and .css) for each client. FOLDER is beside the drivers' own.
export async function bundle_all(clients, folder) {
  if (clients.length === 0) return;
  for (const client of clients) writeFileSync(`${folder}/${client.name}.js`, entry(client));
  await build({
    entryPoints: clients.map(({ name }) => `${folder}/${name}.js`),
    outdir: `${folder}/out`,
    bundle: true,
    splitting: true,
    format: "esm",
    target: "esnext",
    define: { global: "globalThis", "process.env.NODE_ENV": '"production"' },
    loader: { ".wasm": "file" },
    logLevel: "error",
  });
}
