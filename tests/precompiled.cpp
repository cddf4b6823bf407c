// Nothing: what is precompiled for all tests belongs to a target, and a target wants a source.
