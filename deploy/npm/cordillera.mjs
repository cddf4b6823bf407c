#!/usr/bin/env node
// The program that lies beside this file, with the words, the streams, the signals and the exit code of this process.
import { spawn } from "node:child_process";
import { fileURLToPath } from "node:url";

// Before the program is there: it may have spoken before this process is heard again, and then be sent a signal.
for (const signal of ["SIGTERM", "SIGHUP"]) process.on(signal, () => program.kill(signal));
// A terminal sends Ctrl+C to both, and two of them end the program at once: it has its own, and this process waits for what it makes of it.
process.on("SIGINT", () => {});
const program = spawn(fileURLToPath(new URL("program/bin/cordillera", import.meta.url)), process.argv.slice(2), { stdio: "inherit" });
program.on("error", (error) => {
  console.error(`cordillera: ${error.message}`);
  process.exit(1);
});
program.on("exit", (code, signal) => {
  if (!signal) process.exit(code);
  process.removeAllListeners(signal);
  process.kill(process.pid, signal);
});
