#!/usr/bin/env python3
"""Writes an ARXML file of a size: service interfaces with structures, deployments and instances, each of its own. With
--classic, a system description of one network, with an event, a server and a client for each service.

Usage: large_arxml.py MEGABYTES FILE [--classic]. docs/describe_arxml.md has what reading it takes.
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


CHANNEL = "/Com/Cluster/Channel"
#: What a Classic system description has for each service, in the places of CLASSIC below.
PARTS = {
    "pdus": "<I-SIGNAL-I-PDU><SHORT-NAME>Pdu{n}</SHORT-NAME><LENGTH>120</LENGTH></I-SIGNAL-I-PDU>\n",
    "triggerings": "<PDU-TRIGGERING><SHORT-NAME>Triggering{n}</SHORT-NAME>"
                   "<I-PDU-REF DEST=\"I-SIGNAL-I-PDU\">/Com/Pdu{n}</I-PDU-REF></PDU-TRIGGERING>\n",
    "endpoints": "<NETWORK-ENDPOINT><SHORT-NAME>Host{n}</SHORT-NAME><NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION>"
                 "<IPV-4-ADDRESS>10.{a}.{b}.{c}</IPV-4-ADDRESS><IPV-4-ADDRESS-SOURCE>FIXED</IPV-4-ADDRESS-SOURCE>"
                 "</IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></NETWORK-ENDPOINT>\n",
    "bundles": "<SOCKET-CONNECTION-BUNDLE><SHORT-NAME>Bundle{n}</SHORT-NAME><BUNDLED-CONNECTIONS><SOCKET-CONNECTION>\n"
               "<CLIENT-PORT-REF DEST=\"SOCKET-ADDRESS\">{channel}/Client{n}</CLIENT-PORT-REF><PDUS>"
               "<SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>{header}</HEADER-ID>"
               "<PDU-TRIGGERING-REF DEST=\"PDU-TRIGGERING\">{channel}/Triggering{n}</PDU-TRIGGERING-REF>"
               "</SOCKET-CONNECTION-IPDU-IDENTIFIER></PDUS></SOCKET-CONNECTION></BUNDLED-CONNECTIONS>\n"
               "<SERVER-PORT-REF DEST=\"SOCKET-ADDRESS\">{channel}/Server{n}</SERVER-PORT-REF></SOCKET-CONNECTION-BUNDLE>\n",
    "sockets": "<SOCKET-ADDRESS><SHORT-NAME>Server{n}</SHORT-NAME><APPLICATION-ENDPOINT><SHORT-NAME>Ends</SHORT-NAME>\n"
               "<NETWORK-ENDPOINT-REF DEST=\"NETWORK-ENDPOINT\">{channel}/Host{n}</NETWORK-ENDPOINT-REF>"
               "<PROVIDED-SERVICE-INSTANCES><PROVIDED-SERVICE-INSTANCE><SHORT-NAME>Service{n}</SHORT-NAME>\n"
               "<EVENT-HANDLERS><EVENT-HANDLER><SHORT-NAME>Group</SHORT-NAME><CONSUMED-EVENT-GROUP-REFS>"
               "<CONSUMED-EVENT-GROUP-REF DEST=\"CONSUMED-EVENT-GROUP\">{channel}/Client{n}/Ends/Use/Group"
               "</CONSUMED-EVENT-GROUP-REF></CONSUMED-EVENT-GROUP-REFS></EVENT-HANDLER></EVENT-HANDLERS>\n"
               "<INSTANCE-IDENTIFIER>1</INSTANCE-IDENTIFIER><SERVICE-IDENTIFIER>{service}</SERVICE-IDENTIFIER>"
               "</PROVIDED-SERVICE-INSTANCE></PROVIDED-SERVICE-INSTANCES>\n<TP-CONFIGURATION><UDP-TP><UDP-TP-PORT>"
               "<PORT-NUMBER>30501</PORT-NUMBER></UDP-TP-PORT></UDP-TP></TP-CONFIGURATION></APPLICATION-ENDPOINT></SOCKET-ADDRESS>\n"
               "<SOCKET-ADDRESS><SHORT-NAME>Client{n}</SHORT-NAME><APPLICATION-ENDPOINT><SHORT-NAME>Ends</SHORT-NAME>\n"
               "<CONSUMED-SERVICE-INSTANCES><CONSUMED-SERVICE-INSTANCE><SHORT-NAME>Use</SHORT-NAME><CONSUMED-EVENT-GROUPS>"
               "<CONSUMED-EVENT-GROUP><SHORT-NAME>Group</SHORT-NAME><EVENT-GROUP-IDENTIFIER>1</EVENT-GROUP-IDENTIFIER>"
               "</CONSUMED-EVENT-GROUP></CONSUMED-EVENT-GROUPS>\n<PROVIDED-SERVICE-INSTANCE-REF "
               "DEST=\"PROVIDED-SERVICE-INSTANCE\">{channel}/Server{n}/Ends/Service{n}</PROVIDED-SERVICE-INSTANCE-REF>"
               "</CONSUMED-SERVICE-INSTANCE></CONSUMED-SERVICE-INSTANCES>\n"
               "<NETWORK-ENDPOINT-REF DEST=\"NETWORK-ENDPOINT\">{channel}/Host{n}</NETWORK-ENDPOINT-REF>"
               "<TP-CONFIGURATION><UDP-TP><UDP-TP-PORT><PORT-NUMBER>40001</PORT-NUMBER></UDP-TP-PORT></UDP-TP>"
               "</TP-CONFIGURATION></APPLICATION-ENDPOINT></SOCKET-ADDRESS>\n",
}
CLASSIC = ["<AR-PACKAGE><SHORT-NAME>Com</SHORT-NAME><ELEMENTS>\n", "pdus",
           "<ETHERNET-CLUSTER><SHORT-NAME>Cluster</SHORT-NAME><ETHERNET-CLUSTER-VARIANTS><ETHERNET-CLUSTER-CONDITIONAL>"
           "<PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Channel</SHORT-NAME>\n<PDU-TRIGGERINGS>", "triggerings",
           "</PDU-TRIGGERINGS><NETWORK-ENDPOINTS>\n", "endpoints", "</NETWORK-ENDPOINTS><SO-AD-CONFIG><CONNECTION-BUNDLES>\n",
           "bundles", "</CONNECTION-BUNDLES><SOCKET-ADDRESSS>\n", "sockets",
           "</SOCKET-ADDRESSS></SO-AD-CONFIG></ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL>"
           "</ETHERNET-CLUSTER-VARIANTS></ETHERNET-CLUSTER>\n</ELEMENTS></AR-PACKAGE>\n"]


def part(name, number):
    service = 1 + number % 0xfff0
    return PARTS[name].format(n=number, channel=CHANNEL, service=service, header=service << 16 | 0x8001,
                              a=number >> 16 & 0xff, b=number >> 8 & 0xff, c=number & 0xff)


def write_classic(size, out):
    services = max(1, int(size / sum(len(part(name, 10000)) for name in PARTS)))
    for piece in CLASSIC:
        if piece in PARTS:
            out.writelines(part(piece, number) for number in range(services))
        else:
            out.write(piece)


def main():
    size, path = float(sys.argv[1]) * 1e6, sys.argv[2]
    if "--classic" in sys.argv:
        with open(path, "w", encoding="utf-8") as out:
            out.write(HEAD)
            write_classic(size, out)
            out.write("</AR-PACKAGES></AUTOSAR>\n")
        return
    with open(path, "w", encoding="utf-8") as out:
        written = out.write(HEAD)
        number = 0
        while written < size:
            written += out.write(package(number))
            number += 1
        out.write("</AR-PACKAGES></AUTOSAR>\n")


main()
