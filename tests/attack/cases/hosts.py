"""Finding 1: what the Host header may say where a server without tokens takes writes."""
from attack import case, exchange, request, statuses


def deletes(attack, host):
    """DELETE as a page of that host would send it: 401 where it may not, else 404 for there is no such dataset."""
    origin = "Origin: http://%s\r\n" % host
    return statuses(exchange(attack.server, request("DELETE /v1/datasets/none", origin, host=host)))


@case("1 names that a stranger can point at 127.0.0.1", expect="401")
def rebinding(attack):
    hosts = ["127.abc.de", "127.0.0.1.cc", "127.cafe.be", "127.dead.beef", "evil.example", "localhost.evil.example", "127.1.example",
             "127.0.0.1.", "127.1"]
    seen = {deletes(attack, "%s:%d" % (host, attack.server.port)) for host in hosts}
    return " ".join(sorted(seen))


@case("1 loopback by its names and addresses", expect="404")
def loopback(attack):
    hosts = ["localhost", "LOCALHOST", "LocalHost.", "127.0.0.1", "127.255.1.2", "[::1]", "[0:0::1]"]
    seen = {deletes(attack, "%s:%d" % (host, attack.server.port)) for host in hosts}
    return " ".join(sorted(seen))
