"""What an ELF file takes from others and gives to them, by readelf."""
import re
import subprocess


def _readelf(flag, path):
    return subprocess.run(["readelf", "-W", flag, path], check=True, capture_output=True, text=True).stdout


def needed(path):
    """Names of the libraries that the file asks for."""
    return re.findall(r"\(NEEDED\).*\[(.*)\]", _readelf("-d", path))


class Symbol:
    def __init__(self, kind, size, name, version):
        self.kind, self.size, self.name, self.version = kind, size, name, version


def _dynamic(path):
    """(defined?, Symbol) of each line of the dynamic table."""
    line = re.compile(r"^\s*\d+: \S+\s+(\S+) (\S+)\s+(GLOBAL|WEAK|UNIQUE)\s+\S+\s+(\S+) ([^\s@]+)(?:@@?(\S+))?")
    for match in map(line.match, _readelf("--dyn-syms", path).splitlines()):
        if match:
            size, kind, _, section, name, version = match.groups()
            yield section != "UND", Symbol(kind, int(size, 0), name, version)


def taken(path):
    """(name, version) of what others have to define; version: None if any will do."""
    return {(s.name, s.version) for defined, s in _dynamic(path) if not defined}


def given(path):
    """(name, version) -> Symbol of what the file defines; a name may come in several versions."""
    return {(s.name, s.version): s for defined, s in _dynamic(path) if defined}
