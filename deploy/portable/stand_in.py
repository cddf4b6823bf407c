"""A library with another's name and symbols and nothing behind them: whoever calls one is told so, and ends.

GDAL is bound at once to all that its many formats need. Cordillera opens few of them (raster/gdal/formats.h).
"""
import os
import subprocess

_TELL = r"""
#include <stdlib.h>
#include <unistd.h>
__attribute__((visibility("hidden"), noreturn)) void tell(void) {
  static const char line[] = "cordillera: this archive has no %s; the .deb has it\n";
  if (write(2, line, sizeof line - 1) < 0) _exit(134);
  abort();
}
"""


# Called whether they are needed or not, at the start or the end; no answer will do.
_ANSWERED = ("spatialite_alloc_connection", "xmlCleanupParser")


def _assembly(symbols):
    lines = [".text"]
    for answers in (True, False):
        for s in symbols:
            if s.kind not in ("OBJECT", "TLS") and (s.name in _ANSWERED) == answers:
                lines += ['.globl "%s"' % s.name, '.type "%s", @function' % s.name, '"%s":' % s.name]
        lines += ["xor %eax, %eax", "ret"] if answers else ["jmp tell"]
    lines += [".bss", ".balign 64"]
    for s in symbols:
        if s.kind == "OBJECT":  # such as the tables of a C++ class: their addresses are taken, their contents never read
            lines += ['.globl "%s"' % s.name, '.type "%s", @object' % s.name, '.size "%s", %d' % (s.name, s.size), ".balign 16",
                      '"%s": .zero %d' % (s.name, max(s.size, 1))]
    lines.append('.section .note.GNU-stack, "", @progbits')
    return "\n".join(lines) + "\n"


def _versions(symbols):
    """The version script: the loader complains of a library without the versions that others ask for."""
    nodes = {}
    for s in symbols:
        nodes.setdefault(s.version, []).append(s.name)
    nodes.pop(None, None)
    return "".join('%s { global: %s };\n' % (node, " ".join('"%s";' % n for n in sorted(names))) for node, names in sorted(nodes.items()))


def make(soname, symbols, output, folder, libraries=()):
    """symbols: those that somebody takes. libraries: paths that the stand-in asks for in turn."""
    symbols = sorted(symbols, key=lambda s: s.name)
    source, assembly, script = (os.path.join(folder, soname + end) for end in (".c", ".s", ".map"))
    for path, text in ((source, _TELL % soname), (assembly, _assembly(symbols)), (script, _versions(symbols))):
        with open(path, "w") as file:
            file.write(text)
    words = ["gcc", "-shared", "-fPIC", "-Os", "-s", "-Wl,--build-id=none", "-Wl,-z,noexecstack", "-Wl,-soname," + soname, "-o", output, source, assembly]
    if os.path.getsize(script):
        words.append("-Wl,--version-script=" + script)
    subprocess.run(words + ["-Wl,--no-as-needed", *libraries], check=True)
