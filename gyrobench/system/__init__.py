"""Systems: slots, sockets, binding, wires, order, options, plan."""
