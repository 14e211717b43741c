# SPDX-License-Identifier: Apache-2.0
"""Small files of a port: the maker's register description, and an image with what `target seal` looks for."""

SVD = """<device><name>CHIP</name><version>9</version><peripherals>
<peripheral><name>TIM</name><baseAddress>0x40001000</baseAddress>
  <interrupt><name>TIM_Overflow</name><value>7</value></interrupt>
  <registers>
    <register><name>SC</name><addressOffset>0x4</addressOffset><size>32</size><access>read-write</access>
      <fields><field><name>CLK</name><bitOffset>3</bitOffset><bitWidth>2</bitWidth></field>
              <field><name>EN</name><bitOffset>5</bitOffset><bitWidth>1</bitWidth></field></fields></register>
    <register><name>R%s</name><dim>4</dim><dimIncrement>4</dimIncrement><addressOffset>0x10</addressOffset>
      <size>32</size><access>read-only</access></register>
    <register><name>C0</name><addressOffset>0x30</addressOffset><size>32</size></register>
    <register><name>C1</name><addressOffset>0x34</addressOffset><size>32</size></register>
  </registers></peripheral>
</peripherals></device>"""

SOURCE = """
__attribute__((section(".guarded"), used)) const unsigned char data[6] = {1, 2, 3, 4, 5, 6};
__attribute__((section(".crc"), used)) const unsigned protected_crc = 0xFFFFFFFF;
char big[1000] = {1};
void start(void) { big[1]++; }
"""
SCRIPT = """
ENTRY(start)
SECTIONS {
  .text 0x100 : { *(.text*) }
  .guarded 0x1000 : { protected_start = .; *(.guarded) protected_end = .; . = ALIGN(4); KEEP(*(.crc)) }
  .data 0x20000000 : AT(0x2000) { *(.data*) }
  /DISCARD/ : { *(.ARM*) *(.note*) *(.comment) *(.eh_frame*) }
}
"""
