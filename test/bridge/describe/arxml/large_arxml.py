#!/usr/bin/env python3
"""Writes an ARXML file of a size: service interfaces with structures, deployments and instances, each of its own.

Usage: large_arxml.py MEGABYTES FILE. docs/describe_arxml.md has what reading it takes.
"""
import sys

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<AUTOSAR xmlns="http://autosar.org/schema/r4.0" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://autosar.org/schema/r4.0 AUTOSAR_00051.xsd"><AR-PACKAGES>
"""


def reference(tag, dest, path):
    return f'<{tag} DEST="{dest}">{path}</{tag}>'


def structure(name, members):
    text = f"<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>{name}</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY>\n<SUB-ELEMENTS>\n"
    for member, path in members:
        text += (f"<CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT>\n<SHORT-NAME>{member}</SHORT-NAME>\n<DESC><L-2 L=\"EN\">What {member} of "
                 f"{name} is: a value of the system that somebody measured</L-2></DESC>\n<TYPE-REFERENCE>\n"
                 f"{reference('TYPE-REFERENCE-REF', 'STD-CPP-IMPLEMENTATION-DATA-TYPE', path)}\n</TYPE-REFERENCE>\n"
                 "</CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT>\n")
    return text + "</SUB-ELEMENTS>\n</STD-CPP-IMPLEMENTATION-DATA-TYPE>\n"


def package(number):
    """One service with four structures, eight events and four methods."""
    base = f"/P{number}"
    kinds = ("uint8_t", "uint16_t", "int32_t", "double")
    text = f"<AR-PACKAGE><SHORT-NAME>P{number}</SHORT-NAME><ELEMENTS>\n"
    for one in range(4):
        members = [(f"value_{member}", f"/ara/stdtypes/{kinds[member % 4]}") for member in range(12)]
        if one > 0:
            members.append(("inner", f"{base}/Type{one - 1}"))
        text += structure(f"Type{one}", members)
    text += "<SERVICE-INTERFACE><SHORT-NAME>Service</SHORT-NAME>\n<MAJOR-VERSION>1</MAJOR-VERSION><MINOR-VERSION>0</MINOR-VERSION>\n<EVENTS>\n"
    for event in range(8):
        text += (f"<VARIABLE-DATA-PROTOTYPE><SHORT-NAME>event{event}</SHORT-NAME>"
                 f"{reference('TYPE-TREF', 'STD-CPP-IMPLEMENTATION-DATA-TYPE', f'{base}/Type{event % 4}')}</VARIABLE-DATA-PROTOTYPE>\n")
    text += "</EVENTS>\n<METHODS>\n"
    for method in range(4):
        text += (f"<CLIENT-SERVER-OPERATION><SHORT-NAME>method{method}</SHORT-NAME>\n<ARGUMENTS>"
                 "<ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>what</SHORT-NAME>"
                 f"{reference('TYPE-TREF', 'STD-CPP-IMPLEMENTATION-DATA-TYPE', f'{base}/Type{method}')}<DIRECTION>IN</DIRECTION>"
                 "</ARGUMENT-DATA-PROTOTYPE></ARGUMENTS>\n</CLIENT-SERVER-OPERATION>\n")
    text += "</METHODS>\n</SERVICE-INTERFACE>\n<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Deployment</SHORT-NAME>\n<EVENT-DEPLOYMENTS>\n"
    for event in range(8):
        text += (f"<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>e{event}</SHORT-NAME>{reference('EVENT-REF', 'VARIABLE-DATA-PROTOTYPE', f'{base}/Service/event{event}')}"
                 f"<EVENT-ID>{0x8001 + event}</EVENT-ID><TRANSPORT-PROTOCOL>UDP</TRANSPORT-PROTOCOL></SOMEIP-EVENT-DEPLOYMENT>\n")
    text += "</EVENT-DEPLOYMENTS>\n<METHOD-DEPLOYMENTS>\n"
    for method in range(4):
        text += (f"<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>m{method}</SHORT-NAME>{reference('METHOD-REF', 'CLIENT-SERVER-OPERATION', f'{base}/Service/method{method}')}"
                 f"<METHOD-ID>{1 + method}</METHOD-ID><TRANSPORT-PROTOCOL>UDP</TRANSPORT-PROTOCOL></SOMEIP-METHOD-DEPLOYMENT>\n")
    return text + ("</METHOD-DEPLOYMENTS>\n" + reference("SERVICE-INTERFACE-REF", "SERVICE-INTERFACE", f"{base}/Service") +
                   f"\n<SERVICE-INTERFACE-ID>{1 + number % 0xfff0}</SERVICE-INTERFACE-ID>\n</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>\n"
                   "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Instance</SHORT-NAME>"
                   f"{reference('SERVICE-INTERFACE-DEPLOYMENT-REF', 'SOMEIP-SERVICE-INTERFACE-DEPLOYMENT', f'{base}/Deployment')}"
                   "<SERVICE-INSTANCE-ID>1</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>\n</ELEMENTS></AR-PACKAGE>\n")


def main():
    size, path = float(sys.argv[1]) * 1e6, sys.argv[2]
    with open(path, "w", encoding="utf-8") as out:
        written = out.write(HEAD)
        number = 0
        while written < size:
            written += out.write(package(number))
            number += 1
        out.write("</AR-PACKAGES></AUTOSAR>\n")


main()
