# SPDX-License-Identifier: Apache-2.0
"""The errors that are made in a C source, found in its syntax tree (tree-sitter).

The tree is that of the text before the preprocessor. Places that are left out are counted by their reason (EXCLUDED).
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import tree_sitter_c
from tree_sitter import Language, Node, Parser

from fluxtrue_tools.mutate.mutant import Edit, Mutant, named

LANGUAGE: Final = Language(tree_sitter_c.language())
TABLE_NUMBERS: Final = 32  # an initialiser of more numbers is a numeric table

OTHER_OPERATORS: Final = {
    "<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "==": ("!=",), "!=": ("==",),
    "&&": ("||",), "||": ("&&",), "&": ("|",), "|": ("&",), "^": ("|",),
    "+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "%": ("/",), "<<": (">>",), ">>": ("<<",),
}  # fmt: skip
KINDS: Final = {
    **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), "relational"), **dict.fromkeys(("&&", "||"), "logical"),
    **dict.fromkeys(("&", "|", "^"), "bitwise"), **dict.fromkeys(("+", "-", "*", "/", "%"), "arithmetic"),
    **dict.fromkeys(("<<", ">>"), "shift"),
}  # fmt: skip
OTHER_ASSIGNMENTS: Final = {
    "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "|=": "&=", "&=": "|=", "^=": "|=", "<<=": ">>=", ">>=": "<<=",
}  # fmt: skip
DROPPED_OPERANDS: Final = {"&&", "||", "|"}  # either operand alone
TRUTH: Final = {"<", "<=", ">", ">=", "==", "!=", "&&", "||"}

MACRO: Final = "macros that are no single constant: their text is compiled where they are used"
ASSERTION: Final = "static assertions: what violates them does not compile"
TABLE: Final = f"tables of more than {TABLE_NUMBERS} numbers: data, compared as a whole with what they approximate"
DECLARED: Final = "lengths of arrays, widths of bit fields, labels of cases, operands of sizeof"
ASSEMBLY: Final = "instructions by hand: host programs use the portable half of fx/arch.h"
UNREAD: Final = "text that is no C before the preprocessor, for example a list of macro calls"
VALUES: Final = "values of enumerations in headers: codes of interfaces that both sides take from there"
EXCLUDED: Final = {
    "preproc_function_def": MACRO, "preproc_include": None, "preproc_call": None, "comment": None,
    "sizeof_expression": DECLARED, "offsetof_expression": DECLARED, "bitfield_clause": DECLARED,
    "gnu_asm_expression": ASSEMBLY, "attribute_specifier": None, "struct_specifier": None, "union_specifier": None,
    "type_descriptor": None, "ERROR": UNREAD,
}  # fmt: skip
_ASSERTION: Final = re.compile(rb"(?:_Static_assert|static_assert)\b")
_INTEGER: Final = re.compile(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)")
_FRACTION: Final = re.compile(r"(\d+\.\d*|\.\d+)(?:[eE]([+-]?\d+))?([fF]?)")
_CONSTANT_MACRO: Final = re.compile(rb"\(?(?:[A-Z]\w*\()?-?([\w.]+)\)*\s*(?:/\*.*\*/\s*)?")

Found = Iterator[Edit]


def _text(node: Node) -> str:
    assert node.text is not None
    return node.text.decode(errors="replace")


def _replace(node: Node, text: str, operator: str) -> Edit:
    return Edit(node.start_byte, node.end_byte, text, operator)


def _part(node: Node, name: str) -> Node:
    found = node.child_by_field_name(name)
    assert found is not None, f"{node.type} without {name}"
    return found


def _bare(node: Node) -> Node:
    """The expression without the parentheses around it."""
    while node.type == "parenthesized_expression" and node.named_child_count == 1:
        node = node.named_children[0]
    return node


def is_truth(node: Node) -> bool:
    """Whether an expression is a comparison or a combination of truths."""
    node = _bare(node)
    if node.type == "binary_expression":
        return _text(_part(node, "operator")) in TRUTH
    return node.type == "unary_expression" and _text(_part(node, "operator")) == "!"


def _operand(node: Node, operator: str) -> str:
    """An operand that keeps its own operands beside another operator."""
    own = _text(_part(node, "operator")) if node.type == "binary_expression" else operator
    return _text(node) if own == operator or KINDS[operator] not in ("logical", "bitwise") else f"({_text(node)})"


def _joined(node: Node, left: Node, operator: str, right: Node) -> Edit:
    text = f"{_operand(left, operator)} {operator} {_operand(right, operator)}"
    inner = node.parent is not None and node.parent.type in ("binary_expression", "unary_expression", "cast_expression")
    weaker = inner and KINDS[operator] in ("logical", "bitwise")
    return _replace(node, f"({text})" if weaker else text, KINDS[operator])


def _binary(node: Node) -> Found:
    left, right, operator = _part(node, "left"), _part(node, "right"), _text(_part(node, "operator"))
    for other in OTHER_OPERATORS.get(operator, ()):
        if KINDS[operator] in ("logical", "bitwise"):
            yield _joined(node, left, other, right)
        else:
            yield _replace(_part(node, "operator"), other, KINDS[operator])
    if operator in DROPPED_OPERANDS:
        yield _replace(node, _text(left), "operand dropped")
        yield _replace(node, _text(right), "operand dropped")


def _unary(node: Node) -> Found:
    operand = _part(node, "argument")
    if operand.type != "number_literal":
        yield _replace(node, _text(operand), "negation dropped")


def _update(node: Node) -> Found:
    operator = _part(node, "operator")
    yield _replace(operator, "--" if _text(operator) == "++" else "++", "arithmetic")


def _assignment(node: Node) -> Found:
    operator = _part(node, "operator")
    if other := OTHER_ASSIGNMENTS.get(_text(operator)):
        yield _replace(operator, other, "compound assignment")


def other_numbers(text: str) -> tuple[str, ...]:
    """What replaces a number: one more, and 0; of a fraction nine tenths (it stays in its range), and 0."""
    if whole := _INTEGER.fullmatch(text):
        value = int(whole[1], 0) if not re.fullmatch(r"0\d+", whole[1]) else int(whole[1], 8)
        more = f"0x{value + 1:X}" if whole[1][:2] in ("0x", "0X") else str(value + 1)
        return (f"{more}{whole[2]}",) + ((f"0{whole[2]}",) if value else ())
    if fraction := _FRACTION.fullmatch(text):
        value = float(text.rstrip("fF"))
        return (f"{value * 0.9!r}{fraction[3]}", f"0.0{fraction[3]}") if value else (f"1.0{fraction[3]}",)
    return ()


def _number(node: Node) -> Found:
    for other in other_numbers(_text(node)):
        yield _replace(node, other, "constant")


def _condition(node: Node) -> Found:
    condition = _part(node, "condition")
    parenthesized = "({})" if condition.type == "parenthesized_expression" else "{}"
    yield _replace(condition, parenthesized.format(1), "condition")
    yield _replace(condition, parenthesized.format(0), "condition")


def _loop(node: Node) -> Found:
    condition = node.child_by_field_name("condition")
    if condition is not None:
        text = "(0)" if condition.type == "parenthesized_expression" else "0"
        yield _replace(condition, text, "condition")


def _nothing_instead(value: Node, operator: str) -> Found:
    """A value that is replaced by zero, or by either truth."""
    if is_truth(value):
        yield _replace(value, "1", operator)
        yield _replace(value, "0", operator)
    elif value.type not in ("number_literal", "true", "false", "initializer_list", "string_literal",
                            "pointer_expression"):  # fmt: skip
        yield _replace(value, f"(__typeof__({_text(value)})){{0}}", operator)


def _return(node: Node) -> Found:
    if node.named_child_count == 0:
        yield _replace(node, ";", "statement deleted")
    else:
        yield from _nothing_instead(node.named_children[0], "returned value")


def _statement(node: Node) -> Found:
    if node.named_child_count == 0:
        return
    does = node.named_children[0]
    if does.type == "cast_expression":  # (void)f(x) does something, (void)x does not
        does = _part(does, "value")
    if does.type in ("assignment_expression", "call_expression", "update_expression"):
        yield _replace(node, ";", "statement deleted")


def _jump(node: Node) -> Found:
    yield _replace(node, ";", "statement deleted")


def _declarator(node: Node) -> Found:
    yield from _nothing_instead(_part(node, "value"), "initial value")


def _pair(node: Node) -> Found:
    value = _part(node, "value")
    if value.type == "initializer_list":
        if _text(value) != "{0}":
            yield _replace(value, "{0}", "element")
    elif value.type not in ("number_literal", "true", "false"):
        yield _replace(value, "0", "element")


def _list(node: Node) -> Found:
    """Elements without a designator; a row of a table goes with its comma."""
    for element, behind in zip(node.children, [*node.children[1:], None], strict=True):
        if element.type == "initializer_list" and behind is not None and behind.type == ",":
            yield Edit(element.start_byte, behind.end_byte, "", "row deleted")
        elif element.is_named and element.type not in ("initializer_list", "initializer_pair", "number_literal", "true",
                                                       "false", "comment", "ERROR"):  # fmt: skip
            yield _replace(element, "0", "element")


def _flip(node: Node) -> Found:
    yield _replace(node, "false" if node.type == "true" else "true", "constant")


OPERATORS: Final[dict[str, Callable[[Node], Found]]] = {
    "binary_expression": _binary, "unary_expression": _unary, "update_expression": _update,
    "assignment_expression": _assignment, "number_literal": _number, "true": _flip, "false": _flip,
    "if_statement": _condition, "conditional_expression": _condition, "while_statement": _loop,
    "do_statement": _loop, "for_statement": _loop, "return_statement": _return, "expression_statement": _statement,
    "break_statement": _jump, "continue_statement": _jump, "init_declarator": _declarator,
    "initializer_pair": _pair, "initializer_list": _list,
}  # fmt: skip


@dataclass
class _Walk:
    """The way through one tree."""

    header: bool
    excluded: Counter[str] = field(default_factory=Counter)

    def edits(self, node: Node, function: str = "") -> Iterator[tuple[str, Edit]]:
        """Pairs of function and edit, in the order of the text."""
        reason = self._reason(node, function)
        if reason is not None:
            self.excluded.update([reason] if reason else [])
            return
        if node.type == "function_definition":
            yield from self.edits(_part(node, "body"), _function_name(node))
            return
        if node.type == "preproc_def":
            yield from ((function, edit) for edit in self._macro(node))
            return
        if operator := OPERATORS.get(node.type):
            yield from ((function, edit) for edit in operator(node))
        skipped = _skipped(node)
        for child in node.named_children:
            if child in skipped:
                self.excluded[DECLARED] += child.type != "identifier"
            else:
                yield from self.edits(child, function)

    def _reason(self, node: Node, function: str) -> str | None:
        """Why a node is left out: the reason, an empty text where there is nothing to change, None if it is not."""
        if node.type in EXCLUDED:
            return EXCLUDED[node.type] or ""
        if node.text is not None and _ASSERTION.match(node.text):
            return ASSERTION
        if node.type == "initializer_list" and not function and _numbers(node) > TABLE_NUMBERS:
            return TABLE
        if node.type == "enumerator" and self.header:
            return VALUES if node.child_by_field_name("value") is not None else ""
        return None

    def _macro(self, node: Node) -> Found:
        """A macro that is a number, or one in another macro: Q15(0.5)."""
        value = node.child_by_field_name("value")
        constant = _CONSTANT_MACRO.fullmatch(value.text) if value is not None and value.text is not None else None
        numbers = other_numbers(constant[1].decode()) if constant is not None else ()
        if value is None or constant is None or not numbers:
            self.excluded.update([MACRO] if value is not None else [])
            return
        start = value.start_byte + constant.start(1)
        for other in numbers:
            yield Edit(start, value.start_byte + constant.end(1), other, "constant")


def _numbers(node: Node) -> int:
    return (node.type == "number_literal") + sum(_numbers(child) for child in node.named_children)


def _skipped(node: Node) -> list[Node]:
    """Children that name a size or a label."""
    names = {"array_declarator": "size", "case_statement": "value", "preproc_if": "condition",
             "preproc_elif": "condition"}  # fmt: skip
    found = node.child_by_field_name(names.get(node.type, "no such field"))
    return [found] if found is not None else []


def _function_name(node: Node) -> str:
    declarator: Node | None = _part(node, "declarator")
    while declarator is not None and declarator.type != "identifier":
        below = declarator.child_by_field_name("declarator")
        declarator = below if below is not None else next(iter(declarator.named_children), None)
    return _text(declarator) if declarator is not None else "?"


def mutants(root: Path, file: str) -> tuple[list[Mutant], Counter[str]]:
    """All mutants of a file below the root, and how many places are left out by reason."""
    source = (root / file).read_bytes()
    walk = _Walk(file.endswith(".h"))
    found = named(file, source, walk.edits(Parser(LANGUAGE).parse(source).root_node))
    return found, walk.excluded
