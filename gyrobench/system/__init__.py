"""What a system is: slots, sockets, binding, wires, order, options, plan."""
