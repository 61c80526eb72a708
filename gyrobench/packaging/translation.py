"""The C of a whole part: its equations, ticks and procedures."""

from __future__ import annotations

import ast

from gyrobench.packaging.c_arrays import Shape
from gyrobench.packaging.source import Code, PartCode
from gyrobench.packaging.translate import PROCEDURE, Method, Procedure


class Translation:
    """The equations of a part as C: ``text`` holds the functions, ``heads`` those that are declared before."""

    def __init__(self, source: PartCode) -> None:
        self.source = source
        self.heads: list[str] = []
        self.functions: list[str] = []
        self.procedures: dict[tuple[object, ...], Procedure] = {}
        self.under_way: list[object] = []
        self.names: list[str] = []  # of the procedures, before those of one name are numbered
        self.written: set[str] = set()  # by the sampled methods
        self.named: dict[str, int] = {}  # equations of a name
        for kind in ("start", "flow", "outputs"):
            self.equation(kind, False)
        for kind in ("flow", "outputs"):
            self.equation(kind, True)
        self.sampled()
        for code in source.uncalled():  # refused even where nothing calls them
            if not code.arguments and all(code.function is not key[0] for key in self.procedures):
                self.procedure(code, (), False, code.node, code)

    def equation(self, kind: str, dual: bool) -> None:
        """Translate one kind of equation: its pieces and, for several, a function that calls them in turn."""
        suffix = "_d" if dual else ""
        pieces = self.source.equations[kind]
        seed = ", Vars *seed" if dual else ""
        args = "part, seed" if dual else "part"
        if len(pieces) == 1 and pieces[0][1].placed is None:
            self.functions.append(Method(self, pieces[0][1], dual, kind).text(kind + suffix)[1])
            return
        calls = []
        for piece, code in pieces:
            method = Method(self, code, dual, kind)
            name = self.own_name(f"{code.placed.name if code.placed else piece.owner.__name__}_{kind}{suffix}")
            where = f"{code.placed.name}: {type(code.placed.block).__name__}" if code.placed else piece.owner.__name__
            self.functions.append(f"/* {where} */\n{method.text(name)[1]}")
            calls.append(f"    {name}({args});")
            calls += ["    if (part->failed) return;"] * method.refuses
        unused = ["    (void)part;", *(["    (void)seed;"] * dual)] if not calls else []
        head = f"static inline void {kind}{suffix}(Part *part{seed})"
        self.functions.append("\n".join([f"{head} {{", *unused, *calls, "}"]))

    def own_name(self, name: str) -> str:
        """Return a name that no other equation has: blocks within a block whose suffix is "" are named as it is."""
        self.named[name] = self.named.get(name, 0) + 1
        return name if self.named[name] == 1 else f"{name}{self.named[name]}_"

    def sampled(self) -> None:
        turns = []
        for piece, code in self.source.equations["sampled"]:
            method = Method(self, code, False, "sampled")
            bases = sum(c.node.name == code.node.name for _, c in self.source.equations["sampled"]) > 1
            owner = code.placed.name if code.placed else piece.owner.__name__ if bases else ""
            # no name of the runtime ends so
            name = self.own_name((f"{owner}_{code.node.name}" if owner else code.node.name) + "_")
            self.functions.append(method.text(name)[1])
            self.written |= method.touched
            call = f"{name}(part);"
            if piece.every > 1:
                call = f"if (fmod(part->n.v.tick, {piece.every}.0) == 0.0) {call}"
            turns.append(f"    {call}")
            turns += ["    if (part->failed) return;"] * method.refuses
        self.functions.append(
            "\n".join(["static inline void ticks(Part *part) {", *(turns or ["    (void)part;"]), "}"])
        )

    def procedure(self, code: Code, shapes: tuple[Shape, ...], dual: bool, node: ast.AST, caller: Code) -> Procedure:
        """Return a procedure for arguments of these shapes, translated where it is not yet."""
        key = (code.function, code.placed.name if code.placed else "", shapes, dual)
        if key in self.procedures:
            return self.procedures[key]
        if (outside := getattr(code.function, "outside", None)) is not None:  # the law of a controller in C
            self.functions.append(outside.glue)
            self.procedures[key] = Procedure("law_", (outside.size,))
            return self.procedures[key]
        if key in self.under_way:
            raise caller.refuse(node, f"{code.node.name} calls itself: equations have no recursion")
        self.under_way.append(key)
        name = f"{code.placed.name}_{code.node.name}" if code.placed else code.node.name
        if code.owner is not None and getattr(code.owner, code.node.name, code.function) is not code.function:
            name = f"{code.function.__qualname__.split('.')[-2:][0]}_{name}"  # one that super() calls
        name += "_d" if dual else "_"
        self.names.append(name)
        same = self.names.count(name)
        name += str(same) if same > 1 else ""
        method = Method(self, code, dual, PROCEDURE, shapes)
        head, text = method.text(name)
        self.under_way.pop()
        self.heads.append(head + ";")
        self.functions.append(text)
        procedure = Procedure(name, method.result if method.returns_value else None, method.touched, method.refuses)
        self.procedures[key] = procedure
        return procedure

    @property
    def text(self) -> str:
        return "\n\n".join((["\n".join(self.heads)] if self.heads else []) + self.functions)
