#!/bin/sh
# make_keystore.sh FOLDER ENCLAVE...: a keystore as `ros2 security` makes it. Enclaves may use the topics rt/allowed and
# ros_discovery_info.
set -eu
mkdir -p "$1/enclaves"
cd "$1"
shift
openssl ecparam -name prime256v1 -genkey -noout -out ca.key
openssl req -new -x509 -sha256 -key ca.key -subj /CN=testCA -days 2 -out ca.cert.pem
sign() { openssl smime -sign -text -in "$1" -out "$2" -signer ca.cert.pem -inkey ca.key; }

cat >governance.xml <<END
<?xml version="1.0" encoding="utf-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-Security/20170801/omg_shared_ca_governance.xsd">
  <domain_access_rules><domain_rule>
    <domains><id_range><min>0</min><max>232</max></id_range></domains>
    <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
    <enable_join_access_control>true</enable_join_access_control>
    <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
    <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
    <rtps_protection_kind>SIGN</rtps_protection_kind>
    <topic_access_rules><topic_rule>
      <topic_expression>*</topic_expression>
      <enable_discovery_protection>true</enable_discovery_protection>
      <enable_liveliness_protection>true</enable_liveliness_protection>
      <enable_read_access_control>true</enable_read_access_control>
      <enable_write_access_control>true</enable_write_access_control>
      <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
      <data_protection_kind>ENCRYPT</data_protection_kind>
    </topic_rule></topic_access_rules>
  </domain_rule></domain_access_rules>
</dds>
END
sign governance.xml governance.p7s

for enclave; do
  folder=enclaves$enclave
  mkdir -p "$folder"
  openssl ecparam -name prime256v1 -genkey -noout -out "$folder/key.pem"
  openssl req -new -sha256 -key "$folder/key.pem" -subj "/CN=$(echo "$enclave" | sed 's,/,\\/,g')" -out csr.pem
  openssl x509 -req -sha256 -in csr.pem -CA ca.cert.pem -CAkey ca.key -CAcreateserial -days 2 -out "$folder/cert.pem" 2>/dev/null
  topics="<topics><topic>rt/allowed</topic><topic>ros_discovery_info</topic></topics>"
  cat >permissions.xml <<END
<?xml version="1.0" encoding="utf-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-Security/20170801/omg_shared_ca_permissions.xsd">
  <permissions><grant name="$enclave">
    <subject_name>CN=$enclave</subject_name>
    <validity><not_before>2020-01-01T00:00:00</not_before><not_after>2099-01-01T00:00:00</not_after></validity>
    <allow_rule>
      <domains><id_range><min>0</min><max>232</max></id_range></domains>
      <publish>$topics</publish><subscribe>$topics</subscribe>
    </allow_rule>
    <default>DENY</default>
  </grant></permissions>
</dds>
END
  sign permissions.xml "$folder/permissions.p7s"
  cp ca.cert.pem "$folder/identity_ca.cert.pem"
  cp ca.cert.pem "$folder/permissions_ca.cert.pem"
  cp governance.p7s "$folder/governance.p7s"
done
