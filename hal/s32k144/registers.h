/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_REGISTERS_H
#define HAL_S32K144_REGISTERS_H
/** Registers of the S32K144 that this port uses: names, addresses and bits.
 * Source   S32K144.svd, version 1.6; written by `tools/fluxtrue target registers`
 *          from registers.toml: change that list, not this file
 * Context  private to the port; with FAKE_REGISTERS the instances are variables of a test */
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint8_t reserved0[0x10];
    const volatile uint32_t CSR;
    volatile uint32_t RCCR;
    uint8_t reserved1[0x4];
    volatile uint32_t HCCR;
    uint8_t reserved2[0xe0];
    volatile uint32_t SOSCCSR;
    volatile uint32_t SOSCDIV;
    volatile uint32_t SOSCCFG;
    uint8_t reserved3[0x1f8];
    volatile uint32_t FIRCDIV;
    uint8_t reserved4[0x2f8];
    volatile uint32_t SPLLCSR;
    volatile uint32_t SPLLDIV;
    volatile uint32_t SPLLCFG;
} scg_t;
_Static_assert(offsetof(scg_t, CSR) == 0x10, "CSR");
_Static_assert(offsetof(scg_t, RCCR) == 0x14, "RCCR");
_Static_assert(offsetof(scg_t, HCCR) == 0x1c, "HCCR");
_Static_assert(offsetof(scg_t, SOSCCSR) == 0x100, "SOSCCSR");
_Static_assert(offsetof(scg_t, SOSCDIV) == 0x104, "SOSCDIV");
_Static_assert(offsetof(scg_t, SOSCCFG) == 0x108, "SOSCCFG");
_Static_assert(offsetof(scg_t, FIRCDIV) == 0x304, "FIRCDIV");
_Static_assert(offsetof(scg_t, SPLLCSR) == 0x600, "SPLLCSR");
_Static_assert(offsetof(scg_t, SPLLDIV) == 0x604, "SPLLDIV");
_Static_assert(offsetof(scg_t, SPLLCFG) == 0x608, "SPLLCFG");
#define SCG_CSR_SCS_MASK 0xf000000U
#define SCG_CSR_SCS(x) (((uint32_t)(x) << 24) & 0xf000000U)
#define SCG_RCCR_DIVSLOW_MASK 0xfU
#define SCG_RCCR_DIVSLOW(x) (((uint32_t)(x) << 0) & 0xfU)
#define SCG_RCCR_DIVBUS_MASK 0xf0U
#define SCG_RCCR_DIVBUS(x) (((uint32_t)(x) << 4) & 0xf0U)
#define SCG_RCCR_DIVCORE_MASK 0xf0000U
#define SCG_RCCR_DIVCORE(x) (((uint32_t)(x) << 16) & 0xf0000U)
#define SCG_RCCR_SCS_MASK 0xf000000U
#define SCG_RCCR_SCS(x) (((uint32_t)(x) << 24) & 0xf000000U)
#define SCG_HCCR_DIVSLOW_MASK 0xfU
#define SCG_HCCR_DIVSLOW(x) (((uint32_t)(x) << 0) & 0xfU)
#define SCG_HCCR_DIVBUS_MASK 0xf0U
#define SCG_HCCR_DIVBUS(x) (((uint32_t)(x) << 4) & 0xf0U)
#define SCG_HCCR_DIVCORE_MASK 0xf0000U
#define SCG_HCCR_DIVCORE(x) (((uint32_t)(x) << 16) & 0xf0000U)
#define SCG_HCCR_SCS_MASK 0xf000000U
#define SCG_HCCR_SCS(x) (((uint32_t)(x) << 24) & 0xf000000U)
#define SCG_SOSCCSR_SOSCEN 0x1U
#define SCG_SOSCCSR_SOSCCM 0x10000U
#define SCG_SOSCCSR_SOSCCMRE 0x20000U
#define SCG_SOSCCSR_SOSCVLD 0x1000000U
#define SCG_SOSCDIV_SOSCDIV1_MASK 0x7U
#define SCG_SOSCDIV_SOSCDIV1(x) (((uint32_t)(x) << 0) & 0x7U)
#define SCG_SOSCDIV_SOSCDIV2_MASK 0x700U
#define SCG_SOSCDIV_SOSCDIV2(x) (((uint32_t)(x) << 8) & 0x700U)
#define SCG_SOSCCFG_EREFS 0x4U
#define SCG_SOSCCFG_RANGE_MASK 0x30U
#define SCG_SOSCCFG_RANGE(x) (((uint32_t)(x) << 4) & 0x30U)
#define SCG_FIRCDIV_FIRCDIV2_MASK 0x700U
#define SCG_FIRCDIV_FIRCDIV2(x) (((uint32_t)(x) << 8) & 0x700U)
#define SCG_SPLLCSR_SPLLEN 0x1U
#define SCG_SPLLCSR_SPLLCM 0x10000U
#define SCG_SPLLCSR_SPLLCMRE 0x20000U
#define SCG_SPLLCSR_SPLLVLD 0x1000000U
#define SCG_SPLLDIV_SPLLDIV1_MASK 0x7U
#define SCG_SPLLDIV_SPLLDIV1(x) (((uint32_t)(x) << 0) & 0x7U)
#define SCG_SPLLDIV_SPLLDIV2_MASK 0x700U
#define SCG_SPLLDIV_SPLLDIV2(x) (((uint32_t)(x) << 8) & 0x700U)
#define SCG_SPLLCFG_PREDIV_MASK 0x700U
#define SCG_SPLLCFG_PREDIV(x) (((uint32_t)(x) << 8) & 0x700U)
#define SCG_SPLLCFG_MULT_MASK 0x1f0000U
#define SCG_SPLLCFG_MULT(x) (((uint32_t)(x) << 16) & 0x1f0000U)

typedef struct {
    uint8_t reserved0[0x8];
    volatile uint32_t PMPROT;
    volatile uint32_t PMCTRL;
    uint8_t reserved1[0x4];
    const volatile uint32_t PMSTAT;
} smc_t;
_Static_assert(offsetof(smc_t, PMPROT) == 0x8, "PMPROT");
_Static_assert(offsetof(smc_t, PMCTRL) == 0xc, "PMCTRL");
_Static_assert(offsetof(smc_t, PMSTAT) == 0x14, "PMSTAT");
#define SMC_PMPROT_AHSRUN 0x80U
#define SMC_PMCTRL_RUNM_MASK 0x60U
#define SMC_PMCTRL_RUNM(x) (((uint32_t)(x) << 5) & 0x60U)
#define SMC_PMSTAT_PMSTAT_MASK 0xffU
#define SMC_PMSTAT_PMSTAT(x) (((uint32_t)(x) << 0) & 0xffU)

typedef struct {
    uint8_t reserved0[0x90];
    volatile uint32_t PCC_FlexCAN0;
    uint8_t reserved1[0x8];
    volatile uint32_t PCC_ADC1;
    uint8_t reserved2[0x10];
    volatile uint32_t PCC_LPSPI0;
    uint8_t reserved3[0x10];
    volatile uint32_t PCC_PDB1;
    uint8_t reserved4[0x10];
    volatile uint32_t PCC_PDB0;
    volatile uint32_t PCC_LPIT;
    volatile uint32_t PCC_FTM0;
    uint8_t reserved5[0x4];
    volatile uint32_t PCC_FTM2;
    volatile uint32_t PCC_ADC0;
    uint8_t reserved6[0x34];
    volatile uint32_t PCC_PORTA;
    volatile uint32_t PCC_PORTB;
    volatile uint32_t PCC_PORTC;
    volatile uint32_t PCC_PORTD;
    volatile uint32_t PCC_PORTE;
} pcc_t;
_Static_assert(offsetof(pcc_t, PCC_FlexCAN0) == 0x90, "PCC_FlexCAN0");
_Static_assert(offsetof(pcc_t, PCC_ADC1) == 0x9c, "PCC_ADC1");
_Static_assert(offsetof(pcc_t, PCC_LPSPI0) == 0xb0, "PCC_LPSPI0");
_Static_assert(offsetof(pcc_t, PCC_PDB1) == 0xc4, "PCC_PDB1");
_Static_assert(offsetof(pcc_t, PCC_PDB0) == 0xd8, "PCC_PDB0");
_Static_assert(offsetof(pcc_t, PCC_LPIT) == 0xdc, "PCC_LPIT");
_Static_assert(offsetof(pcc_t, PCC_FTM0) == 0xe0, "PCC_FTM0");
_Static_assert(offsetof(pcc_t, PCC_FTM2) == 0xe8, "PCC_FTM2");
_Static_assert(offsetof(pcc_t, PCC_ADC0) == 0xec, "PCC_ADC0");
_Static_assert(offsetof(pcc_t, PCC_PORTA) == 0x124, "PCC_PORTA");
_Static_assert(offsetof(pcc_t, PCC_PORTB) == 0x128, "PCC_PORTB");
_Static_assert(offsetof(pcc_t, PCC_PORTC) == 0x12c, "PCC_PORTC");
_Static_assert(offsetof(pcc_t, PCC_PORTD) == 0x130, "PCC_PORTD");
_Static_assert(offsetof(pcc_t, PCC_PORTE) == 0x134, "PCC_PORTE");
#define PCC_FLEXCAN0_CGC 0x40000000U
#define PCC_FTM0_PCS_MASK 0x7000000U
#define PCC_FTM0_PCS(x) (((uint32_t)(x) << 24) & 0x7000000U)

typedef struct {
    uint8_t reserved0[0x4];
    volatile uint32_t CHIPCTL;
} sim_t;
_Static_assert(offsetof(sim_t, CHIPCTL) == 0x4, "CHIPCTL");
#define SIM_CHIPCTL_SRAMU_RETEN 0x100000U

typedef struct {
    uint8_t reserved0[0x8];
    const volatile uint32_t SRS;
} rcm_t;
_Static_assert(offsetof(rcm_t, SRS) == 0x8, "SRS");
#define RCM_SRS_LVD 0x2U
#define RCM_SRS_LOC 0x4U
#define RCM_SRS_LOL 0x8U
#define RCM_SRS_WDOG 0x20U
#define RCM_SRS_PIN 0x40U
#define RCM_SRS_POR 0x80U
#define RCM_SRS_LOCKUP 0x200U
#define RCM_SRS_SW 0x400U

typedef struct {
    volatile uint32_t LMEM_PCCCR;
    uint8_t reserved0[0x1c];
    volatile uint32_t PCCRMR;
} lmem_t;
_Static_assert(offsetof(lmem_t, LMEM_PCCCR) == 0x0, "LMEM_PCCCR");
_Static_assert(offsetof(lmem_t, PCCRMR) == 0x20, "PCCRMR");
#define LMEM_PCCCR_ENCACHE 0x1U
#define LMEM_PCCCR_INVW0 0x1000000U
#define LMEM_PCCCR_INVW1 0x4000000U
#define LMEM_PCCCR_GO 0x80000000U
#define LMEM_PCCRMR_R2_MASK 0xc000000U
#define LMEM_PCCRMR_R2(x) (((uint32_t)(x) << 26) & 0xc000000U)

typedef struct {
    uint8_t reserved0[0x1000];
    volatile uint32_t TCD0_SADDR;
    volatile uint16_t TCD0_SOFF;
    volatile uint16_t TCD0_ATTR;
    volatile uint32_t TCD0_NBYTES_MLNO;
    volatile uint32_t TCD0_SLAST;
    volatile uint32_t TCD0_DADDR;
    volatile uint16_t TCD0_DOFF;
    volatile uint16_t TCD0_CITER_ELINKNO;
    volatile uint32_t TCD0_DLASTSGA;
    volatile uint16_t TCD0_CSR;
    volatile uint16_t TCD0_BITER_ELINKNO;
    volatile uint32_t TCD1_SADDR;
} dma_t;
_Static_assert(offsetof(dma_t, TCD0_SADDR) == 0x1000, "TCD0_SADDR");
_Static_assert(offsetof(dma_t, TCD0_SOFF) == 0x1004, "TCD0_SOFF");
_Static_assert(offsetof(dma_t, TCD0_ATTR) == 0x1006, "TCD0_ATTR");
_Static_assert(offsetof(dma_t, TCD0_NBYTES_MLNO) == 0x1008, "TCD0_NBYTES_MLNO");
_Static_assert(offsetof(dma_t, TCD0_SLAST) == 0x100c, "TCD0_SLAST");
_Static_assert(offsetof(dma_t, TCD0_DADDR) == 0x1010, "TCD0_DADDR");
_Static_assert(offsetof(dma_t, TCD0_DOFF) == 0x1014, "TCD0_DOFF");
_Static_assert(offsetof(dma_t, TCD0_CITER_ELINKNO) == 0x1016, "TCD0_CITER_ELINKNO");
_Static_assert(offsetof(dma_t, TCD0_DLASTSGA) == 0x1018, "TCD0_DLASTSGA");
_Static_assert(offsetof(dma_t, TCD0_CSR) == 0x101c, "TCD0_CSR");
_Static_assert(offsetof(dma_t, TCD0_BITER_ELINKNO) == 0x101e, "TCD0_BITER_ELINKNO");
_Static_assert(offsetof(dma_t, TCD1_SADDR) == 0x1020, "TCD1_SADDR");
#define DMA_TCD0_ATTR_DSIZE_MASK 0x7U
#define DMA_TCD0_ATTR_DSIZE(x) (((uint32_t)(x) << 0) & 0x7U)
#define DMA_TCD0_ATTR_SSIZE_MASK 0x700U
#define DMA_TCD0_ATTR_SSIZE(x) (((uint32_t)(x) << 8) & 0x700U)
#define DMA_TCD0_CSR_START 0x1U
#define DMA_TCD0_CSR_MAJORELINK 0x20U
#define DMA_TCD0_CSR_DONE 0x80U
#define DMA_TCD0_CSR_MAJORLINKCH_MASK 0xf00U
#define DMA_TCD0_CSR_MAJORLINKCH(x) (((uint32_t)(x) << 8) & 0xf00U)

typedef struct {
    uint8_t reserved0[0x404];
    volatile uint32_t OCMDR1;
} mscm_t;
_Static_assert(offsetof(mscm_t, OCMDR1) == 0x404, "OCMDR1");
#define MSCM_OCMDR1_OCM1_MASK 0xf0U
#define MSCM_OCMDR1_OCM1(x) (((uint32_t)(x) << 4) & 0xf0U)

typedef struct {
    volatile uint8_t FSTAT;
    uint8_t reserved0[0x3];
    volatile uint8_t FCCOB3;
    volatile uint8_t FCCOB2;
    volatile uint8_t FCCOB1;
    volatile uint8_t FCCOB0;
    volatile uint8_t FCCOB7;
    uint8_t reserved1[0x25];
    volatile uint8_t FERSTAT;
} ftfc_t;
_Static_assert(offsetof(ftfc_t, FSTAT) == 0x0, "FSTAT");
_Static_assert(offsetof(ftfc_t, FCCOB3) == 0x4, "FCCOB3");
_Static_assert(offsetof(ftfc_t, FCCOB2) == 0x5, "FCCOB2");
_Static_assert(offsetof(ftfc_t, FCCOB1) == 0x6, "FCCOB1");
_Static_assert(offsetof(ftfc_t, FCCOB0) == 0x7, "FCCOB0");
_Static_assert(offsetof(ftfc_t, FCCOB7) == 0x8, "FCCOB7");
_Static_assert(offsetof(ftfc_t, FERSTAT) == 0x2e, "FERSTAT");
#define FTFC_FSTAT_MGSTAT0 0x1U
#define FTFC_FSTAT_FPVIOL 0x10U
#define FTFC_FSTAT_ACCERR 0x20U
#define FTFC_FSTAT_RDCOLERR 0x40U
#define FTFC_FSTAT_CCIF 0x80U
#define FTFC_FERSTAT_DFDIF 0x2U

typedef struct {
    volatile uint32_t CS;
    volatile uint32_t CNT;
    volatile uint32_t TOVAL;
    volatile uint32_t WIN;
} wdog_t;
_Static_assert(offsetof(wdog_t, CS) == 0x0, "CS");
_Static_assert(offsetof(wdog_t, CNT) == 0x4, "CNT");
_Static_assert(offsetof(wdog_t, TOVAL) == 0x8, "TOVAL");
_Static_assert(offsetof(wdog_t, WIN) == 0xc, "WIN");
#define WDOG_CS_UPDATE 0x20U
#define WDOG_CS_EN 0x80U
#define WDOG_CS_CLK_MASK 0x300U
#define WDOG_CS_CLK(x) (((uint32_t)(x) << 8) & 0x300U)
#define WDOG_CS_RCS 0x400U
#define WDOG_CS_ULK 0x800U
#define WDOG_CS_CMD32EN 0x2000U
#define WDOG_CS_WIN 0x8000U

typedef struct {
    volatile uint32_t PCR[32];
} port_t;
_Static_assert(offsetof(port_t, PCR) == 0x0, "PCR");
#define PORT_PCR_PS 0x1U
#define PORT_PCR_PE 0x2U
#define PORT_PCR_MUX_MASK 0x700U
#define PORT_PCR_MUX(x) (((uint32_t)(x) << 8) & 0x700U)

typedef struct {
    uint8_t reserved0[0x4];
    volatile uint32_t PSOR;
    volatile uint32_t PCOR;
    uint8_t reserved1[0x4];
    const volatile uint32_t PDIR;
    volatile uint32_t PDDR;
} gpio_t;
_Static_assert(offsetof(gpio_t, PSOR) == 0x4, "PSOR");
_Static_assert(offsetof(gpio_t, PCOR) == 0x8, "PCOR");
_Static_assert(offsetof(gpio_t, PDIR) == 0x10, "PDIR");
_Static_assert(offsetof(gpio_t, PDDR) == 0x14, "PDDR");

typedef struct {
    uint8_t reserved0[0x28];
    volatile uint32_t TRGMUX_FTM0;
    uint8_t reserved1[0xc];
    volatile uint32_t TRGMUX_PDB0;
    volatile uint32_t TRGMUX_PDB1;
    uint8_t reserved2[0x1c];
    volatile uint32_t TRGMUX_LPSPI0;
} trgmux_t;
_Static_assert(offsetof(trgmux_t, TRGMUX_FTM0) == 0x28, "TRGMUX_FTM0");
_Static_assert(offsetof(trgmux_t, TRGMUX_PDB0) == 0x38, "TRGMUX_PDB0");
_Static_assert(offsetof(trgmux_t, TRGMUX_PDB1) == 0x3c, "TRGMUX_PDB1");
_Static_assert(offsetof(trgmux_t, TRGMUX_LPSPI0) == 0x5c, "TRGMUX_LPSPI0");
#define TRGMUX_FTM0_SEL0_MASK 0x3fU
#define TRGMUX_FTM0_SEL0(x) (((uint32_t)(x) << 0) & 0x3fU)
#define TRGMUX_PDB0_SEL0_MASK 0x3fU
#define TRGMUX_PDB0_SEL0(x) (((uint32_t)(x) << 0) & 0x3fU)
#define TRGMUX_PDB1_SEL0_MASK 0x3fU
#define TRGMUX_PDB1_SEL0(x) (((uint32_t)(x) << 0) & 0x3fU)
#define TRGMUX_LPSPI0_SEL0_MASK 0x3fU
#define TRGMUX_LPSPI0_SEL0(x) (((uint32_t)(x) << 0) & 0x3fU)

typedef struct {
    volatile uint32_t SC;
    volatile uint32_t CNT;
    volatile uint32_t MOD;
    volatile uint32_t C0SC;
    volatile uint32_t C0V;
    volatile uint32_t C1SC;
    volatile uint32_t C1V;
    volatile uint32_t C2SC;
    volatile uint32_t C2V;
    volatile uint32_t C3SC;
    volatile uint32_t C3V;
    volatile uint32_t C4SC;
    volatile uint32_t C4V;
    volatile uint32_t C5SC;
    volatile uint32_t C5V;
    volatile uint32_t C6SC;
    volatile uint32_t C6V;
    volatile uint32_t C7SC;
    volatile uint32_t C7V;
    volatile uint32_t CNTIN;
    uint8_t reserved0[0x4];
    volatile uint32_t MODE;
    volatile uint32_t SYNC;
    uint8_t reserved1[0x4];
    volatile uint32_t OUTMASK;
    volatile uint32_t COMBINE;
    volatile uint32_t DEADTIME;
    volatile uint32_t EXTTRIG;
    volatile uint32_t POL;
    volatile uint32_t FMS;
    volatile uint32_t FILTER;
    volatile uint32_t FLTCTRL;
    volatile uint32_t QDCTRL;
    volatile uint32_t CONF;
    volatile uint32_t FLTPOL;
    volatile uint32_t SYNCONF;
    uint8_t reserved2[0x4];
    volatile uint32_t SWOCTRL;
} ftm_t;
_Static_assert(offsetof(ftm_t, SC) == 0x0, "SC");
_Static_assert(offsetof(ftm_t, CNT) == 0x4, "CNT");
_Static_assert(offsetof(ftm_t, MOD) == 0x8, "MOD");
_Static_assert(offsetof(ftm_t, C0SC) == 0xc, "C0SC");
_Static_assert(offsetof(ftm_t, C0V) == 0x10, "C0V");
_Static_assert(offsetof(ftm_t, C1SC) == 0x14, "C1SC");
_Static_assert(offsetof(ftm_t, C1V) == 0x18, "C1V");
_Static_assert(offsetof(ftm_t, C2SC) == 0x1c, "C2SC");
_Static_assert(offsetof(ftm_t, C2V) == 0x20, "C2V");
_Static_assert(offsetof(ftm_t, C3SC) == 0x24, "C3SC");
_Static_assert(offsetof(ftm_t, C3V) == 0x28, "C3V");
_Static_assert(offsetof(ftm_t, C4SC) == 0x2c, "C4SC");
_Static_assert(offsetof(ftm_t, C4V) == 0x30, "C4V");
_Static_assert(offsetof(ftm_t, C5SC) == 0x34, "C5SC");
_Static_assert(offsetof(ftm_t, C5V) == 0x38, "C5V");
_Static_assert(offsetof(ftm_t, C6SC) == 0x3c, "C6SC");
_Static_assert(offsetof(ftm_t, C6V) == 0x40, "C6V");
_Static_assert(offsetof(ftm_t, C7SC) == 0x44, "C7SC");
_Static_assert(offsetof(ftm_t, C7V) == 0x48, "C7V");
_Static_assert(offsetof(ftm_t, CNTIN) == 0x4c, "CNTIN");
_Static_assert(offsetof(ftm_t, MODE) == 0x54, "MODE");
_Static_assert(offsetof(ftm_t, SYNC) == 0x58, "SYNC");
_Static_assert(offsetof(ftm_t, OUTMASK) == 0x60, "OUTMASK");
_Static_assert(offsetof(ftm_t, COMBINE) == 0x64, "COMBINE");
_Static_assert(offsetof(ftm_t, DEADTIME) == 0x68, "DEADTIME");
_Static_assert(offsetof(ftm_t, EXTTRIG) == 0x6c, "EXTTRIG");
_Static_assert(offsetof(ftm_t, POL) == 0x70, "POL");
_Static_assert(offsetof(ftm_t, FMS) == 0x74, "FMS");
_Static_assert(offsetof(ftm_t, FILTER) == 0x78, "FILTER");
_Static_assert(offsetof(ftm_t, FLTCTRL) == 0x7c, "FLTCTRL");
_Static_assert(offsetof(ftm_t, QDCTRL) == 0x80, "QDCTRL");
_Static_assert(offsetof(ftm_t, CONF) == 0x84, "CONF");
_Static_assert(offsetof(ftm_t, FLTPOL) == 0x88, "FLTPOL");
_Static_assert(offsetof(ftm_t, SYNCONF) == 0x8c, "SYNCONF");
_Static_assert(offsetof(ftm_t, SWOCTRL) == 0x94, "SWOCTRL");
#define FTM_SC_CLKS_MASK 0x18U
#define FTM_SC_CLKS(x) (((uint32_t)(x) << 3) & 0x18U)
#define FTM_SC_PWMEN0 0x10000U
#define FTM_SC_PWMEN1 0x20000U
#define FTM_SC_PWMEN2 0x40000U
#define FTM_SC_PWMEN3 0x80000U
#define FTM_SC_PWMEN4 0x100000U
#define FTM_SC_PWMEN5 0x200000U
#define FTM_SC_PWMEN6 0x400000U
#define FTM_C0SC_ELSB 0x8U
#define FTM_C2SC_ELSA 0x4U
#define FTM_C2SC_CHF 0x80U
#define FTM_MODE_FTMEN 0x1U
#define FTM_MODE_WPDIS 0x4U
#define FTM_MODE_FAULTM_MASK 0x60U
#define FTM_MODE_FAULTM(x) (((uint32_t)(x) << 5) & 0x60U)
#define FTM_MODE_FAULTIE 0x80U
#define FTM_SYNC_CNTMAX 0x2U
#define FTM_SYNC_SYNCHOM 0x8U
#define FTM_SYNC_TRIG0 0x10U
#define FTM_SYNC_SWSYNC 0x80U
#define FTM_COMBINE_COMBINE0 0x1U
#define FTM_COMBINE_COMP0 0x2U
#define FTM_COMBINE_DTEN0 0x10U
#define FTM_COMBINE_SYNCEN0 0x20U
#define FTM_COMBINE_FAULTEN0 0x40U
#define FTM_COMBINE_COMBINE1 0x100U
#define FTM_COMBINE_COMP1 0x200U
#define FTM_COMBINE_DTEN1 0x1000U
#define FTM_COMBINE_SYNCEN1 0x2000U
#define FTM_COMBINE_FAULTEN1 0x4000U
#define FTM_COMBINE_COMBINE2 0x10000U
#define FTM_COMBINE_COMP2 0x20000U
#define FTM_COMBINE_DTEN2 0x100000U
#define FTM_COMBINE_SYNCEN2 0x200000U
#define FTM_COMBINE_FAULTEN2 0x400000U
#define FTM_COMBINE_COMBINE3 0x1000000U
#define FTM_DEADTIME_DTVAL_MASK 0x3fU
#define FTM_DEADTIME_DTVAL(x) (((uint32_t)(x) << 0) & 0x3fU)
#define FTM_DEADTIME_DTPS_MASK 0xc0U
#define FTM_DEADTIME_DTPS(x) (((uint32_t)(x) << 6) & 0xc0U)
#define FTM_DEADTIME_DTVALEX_MASK 0xf0000U
#define FTM_DEADTIME_DTVALEX(x) (((uint32_t)(x) << 16) & 0xf0000U)
#define FTM_EXTTRIG_INITTRIGEN 0x40U
#define FTM_FMS_FAULTIN 0x20U
#define FTM_FMS_WPEN 0x40U
#define FTM_FMS_FAULTF 0x80U
#define FTM_FLTCTRL_FAULT0EN 0x1U
#define FTM_FLTCTRL_FFLTR0EN 0x10U
#define FTM_FLTCTRL_FFVAL_MASK 0xf00U
#define FTM_FLTCTRL_FFVAL(x) (((uint32_t)(x) << 8) & 0xf00U)
#define FTM_QDCTRL_QUADEN 0x1U
#define FTM_QDCTRL_PHBFLTREN 0x40U
#define FTM_QDCTRL_PHAFLTREN 0x80U
#define FTM_CONF_BDMMODE_MASK 0xc0U
#define FTM_CONF_BDMMODE(x) (((uint32_t)(x) << 6) & 0xc0U)
#define FTM_FLTPOL_FLT0POL 0x1U
#define FTM_SYNCONF_SYNCMODE 0x80U
#define FTM_SYNCONF_SWWRBUF 0x200U
#define FTM_SYNCONF_HWOM 0x40000U
#define IRQ_FTM0_FAULT 103U

typedef struct {
    volatile uint32_t SC;
    volatile uint32_t MOD;
    uint8_t reserved0[0x8];
    volatile uint32_t CH0C1;
    volatile uint32_t CH0S;
    volatile uint32_t CH0DLY0;
    uint8_t reserved1[0x4];
    volatile uint32_t CH0DLY2;
    volatile uint32_t CH0DLY3;
    uint8_t reserved2[0x168];
    volatile uint32_t POEN;
    volatile uint32_t PODLY;
} pdb_t;
_Static_assert(offsetof(pdb_t, SC) == 0x0, "SC");
_Static_assert(offsetof(pdb_t, MOD) == 0x4, "MOD");
_Static_assert(offsetof(pdb_t, CH0C1) == 0x10, "CH0C1");
_Static_assert(offsetof(pdb_t, CH0S) == 0x14, "CH0S");
_Static_assert(offsetof(pdb_t, CH0DLY0) == 0x18, "CH0DLY0");
_Static_assert(offsetof(pdb_t, CH0DLY2) == 0x20, "CH0DLY2");
_Static_assert(offsetof(pdb_t, CH0DLY3) == 0x24, "CH0DLY3");
_Static_assert(offsetof(pdb_t, POEN) == 0x190, "POEN");
_Static_assert(offsetof(pdb_t, PODLY) == 0x194, "PODLY");
#define PDB_SC_LDOK 0x1U
#define PDB_SC_PDBEN 0x80U
#define PDB_SC_PDBEIE 0x20000U
#define PDB_CH0C1_EN_MASK 0xffU
#define PDB_CH0C1_EN(x) (((uint32_t)(x) << 0) & 0xffU)
#define PDB_CH0C1_TOS_MASK 0xff00U
#define PDB_CH0C1_TOS(x) (((uint32_t)(x) << 8) & 0xff00U)
#define PDB_CH0C1_BB_MASK 0xff0000U
#define PDB_CH0C1_BB(x) (((uint32_t)(x) << 16) & 0xff0000U)
#define PDB_CH0S_ERR_MASK 0xffU
#define PDB_CH0S_ERR(x) (((uint32_t)(x) << 0) & 0xffU)
#define PDB_PODLY_DLY2_MASK 0xffffU
#define PDB_PODLY_DLY2(x) (((uint32_t)(x) << 0) & 0xffffU)
#define PDB_PODLY_DLY1_MASK 0xffff0000U
#define PDB_PODLY_DLY1(x) (((uint32_t)(x) << 16) & 0xffff0000U)
#define IRQ_PDB0 52U
#define IRQ_PDB1 68U

typedef struct {
    volatile uint32_t SC1[16];
    volatile uint32_t CFG1;
    volatile uint32_t CFG2;
    const volatile uint32_t R[16];
    uint8_t reserved0[0x8];
    volatile uint32_t SC2;
    volatile uint32_t SC3;
    uint8_t reserved1[0x1c];
    volatile uint32_t CLPS;
    volatile uint32_t CLP3;
    volatile uint32_t CLP2;
    volatile uint32_t CLP1;
    volatile uint32_t CLP0;
    volatile uint32_t CLPX;
    volatile uint32_t CLP9;
} adc_t;
_Static_assert(offsetof(adc_t, SC1) == 0x0, "SC1");
_Static_assert(offsetof(adc_t, CFG1) == 0x40, "CFG1");
_Static_assert(offsetof(adc_t, CFG2) == 0x44, "CFG2");
_Static_assert(offsetof(adc_t, R) == 0x48, "R");
_Static_assert(offsetof(adc_t, SC2) == 0x90, "SC2");
_Static_assert(offsetof(adc_t, SC3) == 0x94, "SC3");
_Static_assert(offsetof(adc_t, CLPS) == 0xb4, "CLPS");
_Static_assert(offsetof(adc_t, CLP3) == 0xb8, "CLP3");
_Static_assert(offsetof(adc_t, CLP2) == 0xbc, "CLP2");
_Static_assert(offsetof(adc_t, CLP1) == 0xc0, "CLP1");
_Static_assert(offsetof(adc_t, CLP0) == 0xc4, "CLP0");
_Static_assert(offsetof(adc_t, CLPX) == 0xc8, "CLPX");
_Static_assert(offsetof(adc_t, CLP9) == 0xcc, "CLP9");
#define ADC_SC1_ADCH_MASK 0x1fU
#define ADC_SC1_ADCH(x) (((uint32_t)(x) << 0) & 0x1fU)
#define ADC_SC1_AIEN 0x40U
#define ADC_SC1_COCO 0x80U
#define ADC_CFG1_ADICLK_MASK 0x3U
#define ADC_CFG1_ADICLK(x) (((uint32_t)(x) << 0) & 0x3U)
#define ADC_CFG1_MODE_MASK 0xcU
#define ADC_CFG1_MODE(x) (((uint32_t)(x) << 2) & 0xcU)
#define ADC_CFG1_ADIV_MASK 0x60U
#define ADC_CFG1_ADIV(x) (((uint32_t)(x) << 5) & 0x60U)
#define ADC_CFG2_SMPLTS_MASK 0xffU
#define ADC_CFG2_SMPLTS(x) (((uint32_t)(x) << 0) & 0xffU)
#define ADC_SC2_ADTRG 0x40U
#define ADC_SC3_AVGS_MASK 0x3U
#define ADC_SC3_AVGS(x) (((uint32_t)(x) << 0) & 0x3U)
#define ADC_SC3_AVGE 0x4U
#define ADC_SC3_CAL 0x80U
#define IRQ_ADC0 39U

typedef struct {
    uint8_t reserved0[0x8];
    volatile uint32_t MCR;
    volatile uint32_t MSR;
    volatile uint32_t MIER;
    uint8_t reserved1[0xc];
    volatile uint32_t TVAL0;
    const volatile uint32_t CVAL0;
    volatile uint32_t TCTRL0;
} lpit_t;
_Static_assert(offsetof(lpit_t, MCR) == 0x8, "MCR");
_Static_assert(offsetof(lpit_t, MSR) == 0xc, "MSR");
_Static_assert(offsetof(lpit_t, MIER) == 0x10, "MIER");
_Static_assert(offsetof(lpit_t, TVAL0) == 0x20, "TVAL0");
_Static_assert(offsetof(lpit_t, CVAL0) == 0x24, "CVAL0");
_Static_assert(offsetof(lpit_t, TCTRL0) == 0x28, "TCTRL0");
#define LPIT_MCR_M_CEN 0x1U
#define LPIT_MSR_TIF0 0x1U
#define LPIT_MIER_TIE0 0x1U
#define LPIT_TCTRL0_T_EN 0x1U
#define IRQ_LPIT0_CH0 48U

typedef struct {
    uint8_t reserved0[0x10];
    volatile uint32_t CR;
    volatile uint32_t SR;
    uint8_t reserved1[0x8];
    volatile uint32_t CFGR0;
    volatile uint32_t CFGR1;
    uint8_t reserved2[0x18];
    volatile uint32_t CCR;
    uint8_t reserved3[0x18];
    const volatile uint32_t FSR;
    volatile uint32_t TCR;
    volatile uint32_t TDR;
    uint8_t reserved4[0x8];
    const volatile uint32_t RSR;
    const volatile uint32_t RDR;
} lpspi_t;
_Static_assert(offsetof(lpspi_t, CR) == 0x10, "CR");
_Static_assert(offsetof(lpspi_t, SR) == 0x14, "SR");
_Static_assert(offsetof(lpspi_t, CFGR0) == 0x20, "CFGR0");
_Static_assert(offsetof(lpspi_t, CFGR1) == 0x24, "CFGR1");
_Static_assert(offsetof(lpspi_t, CCR) == 0x40, "CCR");
_Static_assert(offsetof(lpspi_t, FSR) == 0x5c, "FSR");
_Static_assert(offsetof(lpspi_t, TCR) == 0x60, "TCR");
_Static_assert(offsetof(lpspi_t, TDR) == 0x64, "TDR");
_Static_assert(offsetof(lpspi_t, RSR) == 0x70, "RSR");
_Static_assert(offsetof(lpspi_t, RDR) == 0x74, "RDR");
#define LPSPI_CR_MEN 0x1U
#define LPSPI_CR_RTF 0x100U
#define LPSPI_CR_RRF 0x200U
#define LPSPI_SR_RDF 0x2U
#define LPSPI_CFGR0_HREN 0x1U
#define LPSPI_CFGR0_HRPOL 0x2U
#define LPSPI_CFGR0_HRSEL 0x4U
#define LPSPI_CFGR1_MASTER 0x1U
#define LPSPI_CCR_SCKDIV_MASK 0xffU
#define LPSPI_CCR_SCKDIV(x) (((uint32_t)(x) << 0) & 0xffU)
#define LPSPI_CCR_DBT_MASK 0xff00U
#define LPSPI_CCR_DBT(x) (((uint32_t)(x) << 8) & 0xff00U)
#define LPSPI_CCR_PCSSCK_MASK 0xff0000U
#define LPSPI_CCR_PCSSCK(x) (((uint32_t)(x) << 16) & 0xff0000U)
#define LPSPI_CCR_SCKPCS_MASK 0xff000000U
#define LPSPI_CCR_SCKPCS(x) (((uint32_t)(x) << 24) & 0xff000000U)
#define LPSPI_FSR_TXCOUNT_MASK 0x7U
#define LPSPI_FSR_TXCOUNT(x) (((uint32_t)(x) << 0) & 0x7U)
#define LPSPI_FSR_RXCOUNT_MASK 0x70000U
#define LPSPI_FSR_RXCOUNT(x) (((uint32_t)(x) << 16) & 0x70000U)
#define LPSPI_TCR_FRAMESZ_MASK 0xfffU
#define LPSPI_TCR_FRAMESZ(x) (((uint32_t)(x) << 0) & 0xfffU)
#define LPSPI_TCR_PRESCALE_MASK 0x38000000U
#define LPSPI_TCR_PRESCALE(x) (((uint32_t)(x) << 27) & 0x38000000U)
#define LPSPI_TCR_CPHA 0x40000000U
#define LPSPI_RSR_RXEMPTY 0x2U

typedef struct {
    volatile uint32_t MCR;
    volatile uint32_t CTRL1;
    uint8_t reserved0[0x8];
    volatile uint32_t RXMGMASK;
    uint8_t reserved1[0xc];
    volatile uint32_t ESR1;
    uint8_t reserved2[0x4];
    volatile uint32_t IMASK1;
    uint8_t reserved3[0x4];
    volatile uint32_t IFLAG1;
    uint8_t reserved4[0x14];
    volatile uint32_t RXFGMASK;
    uint8_t reserved5[0x34];
    volatile uint32_t EmbeddedRAM[128];
} can_t;
_Static_assert(offsetof(can_t, MCR) == 0x0, "MCR");
_Static_assert(offsetof(can_t, CTRL1) == 0x4, "CTRL1");
_Static_assert(offsetof(can_t, RXMGMASK) == 0x10, "RXMGMASK");
_Static_assert(offsetof(can_t, ESR1) == 0x20, "ESR1");
_Static_assert(offsetof(can_t, IMASK1) == 0x28, "IMASK1");
_Static_assert(offsetof(can_t, IFLAG1) == 0x30, "IFLAG1");
_Static_assert(offsetof(can_t, RXFGMASK) == 0x48, "RXFGMASK");
_Static_assert(offsetof(can_t, EmbeddedRAM) == 0x80, "EmbeddedRAM");
#define CAN_MCR_MAXMB_MASK 0x7fU
#define CAN_MCR_MAXMB(x) (((uint32_t)(x) << 0) & 0x7fU)
#define CAN_MCR_SRXDIS 0x20000U
#define CAN_MCR_SUPV 0x800000U
#define CAN_MCR_FRZACK 0x1000000U
#define CAN_MCR_NOTRDY 0x8000000U
#define CAN_MCR_HALT 0x10000000U
#define CAN_MCR_RFEN 0x20000000U
#define CAN_MCR_FRZ 0x40000000U
#define CAN_MCR_MDIS 0x80000000U
#define CAN_CTRL1_PROPSEG_MASK 0x7U
#define CAN_CTRL1_PROPSEG(x) (((uint32_t)(x) << 0) & 0x7U)
#define CAN_CTRL1_BOFFMSK 0x8000U
#define CAN_CTRL1_PSEG2_MASK 0x70000U
#define CAN_CTRL1_PSEG2(x) (((uint32_t)(x) << 16) & 0x70000U)
#define CAN_CTRL1_PSEG1_MASK 0x380000U
#define CAN_CTRL1_PSEG1(x) (((uint32_t)(x) << 19) & 0x380000U)
#define CAN_CTRL1_RJW_MASK 0xc00000U
#define CAN_CTRL1_RJW(x) (((uint32_t)(x) << 22) & 0xc00000U)
#define CAN_CTRL1_PRESDIV_MASK 0xff000000U
#define CAN_CTRL1_PRESDIV(x) (((uint32_t)(x) << 24) & 0xff000000U)
#define CAN_ESR1_BOFFINT 0x4U
#define CAN_IFLAG1_BUF5I 0x20U
#define CAN_IFLAG1_BUF6I 0x40U
#define CAN_IFLAG1_BUF7I 0x80U
#define IRQ_CAN0_ORED 78U
#define IRQ_CAN0_ORED_0_15_MB 81U

#if defined(FAKE_REGISTERS)
extern scg_t fake_SCG;
#define SCG (&fake_SCG)
extern smc_t fake_SMC;
#define SMC (&fake_SMC)
extern pcc_t fake_PCC;
#define PCC (&fake_PCC)
extern sim_t fake_SIM;
#define SIM (&fake_SIM)
extern rcm_t fake_RCM;
#define RCM (&fake_RCM)
extern lmem_t fake_LMEM;
#define LMEM (&fake_LMEM)
extern dma_t fake_DMA;
#define DMA (&fake_DMA)
extern mscm_t fake_MSCM;
#define MSCM (&fake_MSCM)
extern ftfc_t fake_FTFC;
#define FTFC (&fake_FTFC)
extern wdog_t fake_WDOG;
#define WDOG (&fake_WDOG)
extern port_t fake_PORTA;
#define PORTA (&fake_PORTA)
extern port_t fake_PORTB;
#define PORTB (&fake_PORTB)
extern port_t fake_PORTC;
#define PORTC (&fake_PORTC)
extern port_t fake_PORTD;
#define PORTD (&fake_PORTD)
extern port_t fake_PORTE;
#define PORTE (&fake_PORTE)
extern gpio_t fake_PTB;
#define PTB (&fake_PTB)
extern gpio_t fake_PTC;
#define PTC (&fake_PTC)
extern gpio_t fake_PTD;
#define PTD (&fake_PTD)
extern trgmux_t fake_TRGMUX;
#define TRGMUX (&fake_TRGMUX)
extern ftm_t fake_FTM0;
#define FTM0 (&fake_FTM0)
extern ftm_t fake_FTM2;
#define FTM2 (&fake_FTM2)
extern pdb_t fake_PDB0;
#define PDB0 (&fake_PDB0)
extern pdb_t fake_PDB1;
#define PDB1 (&fake_PDB1)
extern adc_t fake_ADC0;
#define ADC0 (&fake_ADC0)
extern adc_t fake_ADC1;
#define ADC1 (&fake_ADC1)
extern lpit_t fake_LPIT0;
#define LPIT0 (&fake_LPIT0)
extern lpspi_t fake_LPSPI0;
#define LPSPI0 (&fake_LPSPI0)
extern can_t fake_CAN0;
#define CAN0 (&fake_CAN0)
#else
#define SCG ((scg_t *)0x40064000U)
#define SMC ((smc_t *)0x4007e000U)
#define PCC ((pcc_t *)0x40065000U)
#define SIM ((sim_t *)0x40048000U)
#define RCM ((rcm_t *)0x4007f000U)
#define LMEM ((lmem_t *)0xe0082000U)
#define DMA ((dma_t *)0x40008000U)
#define MSCM ((mscm_t *)0x40001000U)
#define FTFC ((ftfc_t *)0x40020000U)
#define WDOG ((wdog_t *)0x40052000U)
#define PORTA ((port_t *)0x40049000U)
#define PORTB ((port_t *)0x4004a000U)
#define PORTC ((port_t *)0x4004b000U)
#define PORTD ((port_t *)0x4004c000U)
#define PORTE ((port_t *)0x4004d000U)
#define PTB ((gpio_t *)0x400ff040U)
#define PTC ((gpio_t *)0x400ff080U)
#define PTD ((gpio_t *)0x400ff0c0U)
#define TRGMUX ((trgmux_t *)0x40063000U)
#define FTM0 ((ftm_t *)0x40038000U)
#define FTM2 ((ftm_t *)0x4003a000U)
#define PDB0 ((pdb_t *)0x40036000U)
#define PDB1 ((pdb_t *)0x40031000U)
#define ADC0 ((adc_t *)0x4003b000U)
#define ADC1 ((adc_t *)0x40027000U)
#define LPIT0 ((lpit_t *)0x40037000U)
#define LPSPI0 ((lpspi_t *)0x4002c000U)
#define CAN0 ((can_t *)0x40024000U)
#endif

#endif
