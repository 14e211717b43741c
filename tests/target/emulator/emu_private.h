/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_EMU_PRIVATE_H
#define EMULATOR_EMU_PRIVATE_H
/** Types and functions that the emulator's files share. All state but that of unicorn is in state_t.
 * Context  emulator only */
#include <unicorn/unicorn.h>

#include "can_port.h"
#include "elf.h"
#include "emu.h"
#include "facts.h"

enum {
    VECTORS = 16 + 123,
    VECTOR_WORDS = (VECTORS + 31) / 32,
    PERIPHERALS_MAX = 40,
    REGISTERS_MAX = 256,
    NEST_MAX = 16,
    ERROR_SIZE = 320,
    EMU_RDC_A0 = 8, /* pins of port C, hal/s32k144/README.md */
    EMU_RDC_A1 = 9,
    EMU_GATE_DRIVER = 3,
    EMU_INDEX = 12, /* of port D */
    EMU_SAFE_STATE = 6,
    RAM_BASE = 0x1FFF8000,
    RAM_SIZE = 0xF000,
    RAM_UPPER = 0x20000000, /* SRAM_U; below it SRAM_L */
    RAM_UPPER_SIZE = RAM_BASE + RAM_SIZE - RAM_UPPER,
    FLASH_SIZE = 0x80000,
    CODE_SIZE = FLASH_SIZE + RAM_SIZE, /* memory from which instructions may come */
    DATA_FLASH_SIZE = 0x10000,
    DATA_FLASH_SECTOR = 0x800,
    DATA_FLASH_SECTORS = DATA_FLASH_SIZE / DATA_FLASH_SECTOR,
    DATA_FLASH_PHRASE = 8,
    DATA_FLASH_BASE = 0x10000000,
    DATA_FLASH_PCCRMR = 0x20, /* of LMEM: caching by region */
    DMA_CHANNELS = 16,
};
#define NEVER UINT64_MAX

typedef enum {
    TIMER_FTM0,
    TIMER_FTM2,
    TIMER_PDB0,
    TIMER_PDB1,
    TIMER_ADC0,
    TIMER_ADC1,
    TIMER_LPIT0,
    TIMER_LPIT1,
    TIMER_LPIT2,
    TIMER_LPIT3,
    TIMER_FAULT,
    TIMER_WDOG,
    TIMER_CAN,
    TIMER_SYSTICK,
    TIMER_FTFC,
    TIMER_DMA,
    TIMERS
} timer_t_;

/* ---- state, part of a snapshot ---- */
typedef struct {
    uint32_t pending[VECTOR_WORDS], enabled[VECTOR_WORDS], line[VECTOR_WORDS];
    uint8_t priority[VECTORS];
    uint8_t active[NEST_MAX];
    uint64_t spent[NEST_MAX]; /* instructions of each active handler so far */
    uint64_t resumed;         /* count of instructions when the innermost handler began or was resumed */
    uint32_t nest;
    uint32_t vtor, aircr, scr, ccr, cpacr, fpccr, fpcar, shcsr, demcr, dwt_ctrl, cyccnt_offset;
    uint32_t systick_csr, systick_rvr;
    uint64_t systick_start;
    bool sleeping;
    int fault; /* vector of the fault that the instruction has caused, 0: none */
    uint32_t fault_pc, cfsr, hfsr, bfar;
} nvic_t;

typedef struct {
    bool running;
    uint64_t start;             /* when the counter was last at CNTIN */
    uint32_t mod, cntin, cv[8]; /* acting values; the registers are their buffers */
    bool software_trigger;
    uint32_t outmask;  /* acting */
    bool triggers_due; /* triggers of the period's start that wait until the pins are set */
    bool tof;
    bool fault_input;                            /* after the filter */
    bool fault_latched, fault_seen, fault_holds; /* FAULTF; FMS was read while it was set; the outputs are off */
    uint64_t stopped_at;                         /* when a debugger halted the counter, 0: it is not halted */
    bool switching;                              /* switching was enabled at the last check */
    uint32_t quad_offset;
    uint32_t shaft;   /* angle up to which the encoder's index has been followed */
    uint32_t read[2]; /* the values of the counter that the program has read last and before that */
} ftm_t;

typedef struct {
    bool running;
    uint64_t start;
    uint32_t mod, idly, dly[8];    /* acting values, loaded by LDOK */
    uint64_t due[10];              /* when each trigger output is due; last: rise and fall of the pulse output */
    uint32_t locked;               /* pre-triggers whose conversion has not set COCO yet */
    uint32_t pulse_up, pulse_down; /* acting values of DLY1 and DLY2 */
} pdb_t;

typedef struct {
    int current; /* SC1 index in conversion + 1, 0: idle */
    bool calibrated;
    uint64_t done;
} adc_t;

typedef struct {
    can_port_frame_t fifo[EMU_CAN_FIFO];
    int fifo_count;
    int sending;        /* mailbox + 1, 0: the bus is free */
    uint32_t filled[4]; /* words of the message memory that have been written since the reset */
} can_t;

typedef struct {
    uint32_t rx[4];
    uint64_t ready[4];
    int rx_count;
    uint64_t busy_until;
    uint32_t tx[4]; /* words that wait for the host request */
    int tx_count;
    bool requested;
    uint64_t requested_at;
} spi_t;

typedef struct {
    uint32_t latched; /* angle at the last SAMPLE */
    uint64_t sampled_at;
    uint8_t fault, sampled_fault; /* kept until it has been read in configuration mode and SAMPLE falls again */
    bool read, high;              /* the fault register was read; level of SAMPLE while software sets it */
    uint8_t address;
} rdc_t;

typedef struct {
    uint16_t answer, errors; /* to the last command; ERRFL */
    emu_encoder_fault_t fault;
} as5047_t;

/* fault: 0 none, 1 open (the board pulls it down), 2 at the reference, 3 at its middle */
typedef struct {
    double offset, amplitude, noise, fault; /* counts, share of the nominal one, counts */
} track_t;

typedef struct {
    track_t track[2];  /* sine, cosine */
    double excitation; /* amplitude, as a share of the nominal one */
    uint32_t random;
} analogue_t;

/* The filter between the output of FTM0's channel 6 and a resolver's windings. */
typedef struct {
    double value, slope; /* of the voltage: 1 = nominal peak; per radian of the resonance */
    uint64_t at;
    uint32_t forced; /* SWOCTRL as it was until then */
    bool enabled;    /* SC.PWMEN6 the same */
} windings_t;

typedef struct {
    bool unlocked, configured;
    uint64_t start;
    uint64_t unlock_end; /* until then registers may be written after an unlock */
    uint64_t acts_from;  /* from then on the written configuration acts and CS.RCS is set */
} wdog_t;

typedef struct {
    uint8_t code, data[DATA_FLASH_PHRASE];
    uint32_t address;
    uint64_t start, end;
} ftfc_t;

typedef struct {
    uint16_t written[DMA_CHANNELS]; /* fields of each descriptor since the reset; one bit per half word */
    uint8_t active;                 /* channel + 1, 0: none */
} dma_t;

typedef struct {
    uint64_t now, limit, due[TIMERS];
    uint64_t event; /* when the event that is being handled was due, NEVER: there is none */
    uint64_t instructions, break_at;
    uint32_t value[PERIPHERALS_MAX][REGISTERS_MAX];
    nvic_t nvic;
    ftm_t ftm[2];
    pdb_t pdb[2];
    adc_t adc[2];
    can_t can;
    spi_t spi[3];
    rdc_t rdc;
    as5047_t as5047;
    analogue_t analogue;
    windings_t windings;
    wdog_t wdog;
    ftfc_t ftfc;
    dma_t dma;
    uint64_t lpit_ready;                  /* from then on the registers of LPIT0 may be written */
    uint32_t core_ticks;                  /* per core cycle */
    uint64_t oscillator_ready, pll_ready; /* from then on they are valid */
    uint32_t pc, resets, reset_cause;
    bool upper_retained; /* SIM_CHIPCTL.SRAMU_RETEN is 0: the RAM must not be accessed and keeps its content */
    bool centre, reset_wanted, poll_masks, reschedule, stop;
    bool halted, stuck; /* emu_core_state_t: in both the core executes nothing while the peripherals continue */
    uint32_t exc_return;
    emu_pins_t pins;
    uint64_t pins_set_at;
} state_t;

/* ---- part of a snapshot, kept over a reset ---- */
typedef struct {
    uint8_t cell[DATA_FLASH_SIZE];
    bool uncertain[DATA_FLASH_SIZE / DATA_FLASH_PHRASE]; /* left half done, or programmed twice */
    /* Lines that the code cache may hold, that the speculation buffer may hold, and that have changed since. */
    bool held[DATA_FLASH_SIZE / 16], speculated[DATA_FLASH_SIZE / 16], stale[DATA_FLASH_SIZE / 16];
    uint32_t erases[DATA_FLASH_SECTORS];
    bool worn[DATA_FLASH_SECTORS]; /* an erase fails its verification */
    bool weak[DATA_FLASH_SECTORS]; /* a bit that cannot be programmed */
    bool slow;                     /* commands take as long as the data sheet allows */
    uint32_t random;
} data_flash_t;

/* ---- not part of a snapshot ---- */
typedef struct peripheral peripheral_t;
struct peripheral {
    const char *name;
    bool (*models)(uint32_t offset);
    /** The value that a read returns; stored: content of the register. */
    uint32_t (*read)(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored);
    /** Called after the store. value: as written, including reserved and read-only bits. */
    void (*written)(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value);
    uint16_t gate; /* offset in PCC, 0: always clocked */
    uint8_t instance;
    bool narrow; /* bytes and half words of its registers may be written */
};

typedef struct {
    uint16_t size, count;
    bool idle;           /* a branch to itself */
    uint8_t conditional; /* instructions that an IT makes conditional */
} block_t;

enum { THUMB_32BIT = 0xE8 }; /* the second byte of a 32-bit instruction is at least this */

typedef struct profile profile_t;

struct emu {
    uc_engine *uc;
    elf_t elf;
    emu_mode_t mode;
    bool as5047;          /* the image was built for this encoder at LPSPI0 */
    bool analogue;        /* for a sine and a cosine at the converters, */
    bool excited;         /* of a resolver */
    uint32_t calibration; /* of a converter, in its clocks */
    const facts_t *facts_of[PERIPHERALS_MAX];
    int16_t *index_of[PERIPHERALS_MAX]; /* by offset: register of facts_of, -1 none */
    int16_t page[256];
    block_t *block; /* by code_place() */
    emu_exception_fn on_exception;
    void *on_exception_user;
    can_port_t *can_port;
    emu_counts_t counts[VECTORS];
    profile_t *profile; /* NULL: not requested */
    bool takes_faults;  /* a fault of the core is an exception, not the end of the emulation */
    bool data_watched;  /* on_data() of core.c is called */
    bool upper_closed;  /* unicorn refuses access to the upper RAM, as s.upper_retained demands */
    char error[ERROR_SIZE];
    data_flash_t flash;
    state_t s;
};

struct emu_snapshot {
    uc_context *context;
    state_t state;
    data_flash_t flash;
    uint8_t ram[RAM_SIZE];
};

/** Half words of the flash, then those of the RAM, are numbered; CODE_SIZE / 2: neither. */
static inline uint32_t code_place(uint32_t address)
{
    if (address < FLASH_SIZE) {
        return address / 2U;
    }
    return address - RAM_BASE < RAM_SIZE ? (FLASH_SIZE + address - RAM_BASE) / 2U : CODE_SIZE / 2U;
}

/* core.c */
/** The only way to write flash and RAM from outside the program, also for DMA and exception frames: what is known of
 * the code there, and what unicorn has translated of it, is discarded; unicorn would continue to use it.
 * false: there is no memory. */
bool emu_memory_write(emu_t *emu, uint32_t address, const void *from, uint32_t size);
void emu_fail(emu_t *emu, const char *format, ...) __attribute__((format(printf, 2, 3)));
uint32_t emu_pc(const emu_t *emu);
void emu_timer(emu_t *emu, timer_t_ timer, uint64_t due);
/** The time at which the event that is being handled was due; without an event, now. What an event starts begins at
 * that time, not at the end of the core's instruction, so that no timer drifts. */
uint64_t emu_instant(const emu_t *emu);
void emu_reset(emu_t *emu, uint32_t cause);
void emu_core_clock(emu_t *emu, uint32_t ticks_per_cycle);
/** After every change of s.upper_retained: permits or refuses access to the upper RAM. */
void emu_upper_ram_update(emu_t *emu);
/** From now on the profile is told of every access to data, which then takes longer to emulate; false: impossible. */
bool emu_data_watch(emu_t *emu);

/* bus.c */
/* The index of each peripheral in the table. The registers of others are read at every access, for example the clock
 * gates in PCC: a search by name took a tenth of the emulation. */
enum {
    PERIPHERAL_SCG,
    PERIPHERAL_PCC,
    PERIPHERAL_SMC,
    PERIPHERAL_PMC,
    PERIPHERAL_RCM,
    PERIPHERAL_SIM,
    PERIPHERAL_TRGMUX,
    PERIPHERAL_FTM0,
    PERIPHERAL_FTM2,
    PERIPHERAL_PDB0,
    PERIPHERAL_PDB1,
    PERIPHERAL_ADC0,
    PERIPHERAL_ADC1,
    PERIPHERAL_LPIT0,
    PERIPHERAL_LPSPI0,
    PERIPHERAL_LPSPI1,
    PERIPHERAL_LPSPI2,
    PERIPHERAL_CAN0,
    PERIPHERAL_WDOG,
    PERIPHERAL_PORTA,
    PERIPHERAL_PORTB,
    PERIPHERAL_PORTC,
    PERIPHERAL_PORTD,
    PERIPHERAL_PORTE,
    PERIPHERAL_PTA,
    PERIPHERAL_PTB,
    PERIPHERAL_PTC,
    PERIPHERAL_PTD,
    PERIPHERAL_PTE,
    PERIPHERAL_LMEM,
    PERIPHERAL_FTFC,
    PERIPHERAL_MSCM,
    PERIPHERAL_DMA,
};
#define PERIPHERAL(name) (&peripherals[PERIPHERAL_##name])
extern const peripheral_t peripherals[];
extern const int peripherals_count;
bool bus_create(emu_t *emu);
void bus_destroy(emu_t *emu);
void bus_reset(emu_t *emu);
uint32_t bus_get(const emu_t *emu, const peripheral_t *peripheral, uint32_t offset);
void bus_put(emu_t *emu, const peripheral_t *peripheral, uint32_t offset, uint32_t value);

/** Whether the address belongs to a peripheral whose clock is off. */
bool bus_unclocked(const emu_t *emu, uint32_t address);
uint64_t bus_read(uc_engine *uc, uint64_t offset, unsigned size, void *user);
void bus_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user);
bool bus_private_read(emu_t *emu, uint32_t address, unsigned size, uint64_t *value);
bool bus_private_write(emu_t *emu, uint32_t address, unsigned size, uint32_t value);

/* nvic.c */
void nvic_reset(emu_t *emu);
void nvic_line(emu_t *emu, int irq, bool level);
void nvic_pend(emu_t *emu, int vector);
void nvic_reconsider(emu_t *emu);
bool nvic_take(emu_t *emu);
void nvic_return(emu_t *emu);
/** A fault of the code that runs; vector: 4 memory, 5 bus, 6 usage. */
void nvic_fault(emu_t *emu, int vector);
uint64_t scs_read(uc_engine *uc, uint64_t offset, unsigned size, void *user);
void scs_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user);
void systick_fire(emu_t *emu);
int nvic_best(const emu_t *emu);

/* faults.c */
/** A fault by the instruction that runs: an access to data, a fetch. False: faults end the emulation. */
bool fault_data(emu_t *emu, uint32_t address);
bool fault_fetch(emu_t *emu, bool never_executable);
/** After unicorn has stopped: enters the exception of the fault; false: there was none. */
bool fault_take(emu_t *emu, uc_err code);

/* profile.c, while emu->profile is not NULL */
void profile_stop(emu_t *emu);
void profile_instruction(emu_t *emu, uint32_t address, uint32_t size);
void profile_access(emu_t *emu, uint32_t address, uint32_t size, bool store);
void profile_enter(emu_t *emu, int vector, uint32_t stack, uint32_t words);
void profile_leave(emu_t *emu, uint32_t stack, uint32_t words);

/* the peripherals' events */
void ftm_fire(emu_t *emu, int instance);
void ftm_triggers(emu_t *emu);
void ftm_fault_input(emu_t *emu);
void ftm_fault_fire(emu_t *emu);
void ftm_debug(emu_t *emu, bool halted);
void pdb_trigger(emu_t *emu, int instance);
void pdb_fire(emu_t *emu, int instance);
/** False: no conversion was started. */
bool adc_pretrigger(emu_t *emu, int instance, int channel);
enum { ADC_CALIBRATION = 14000 }; /* clocks of a calibration, assumed */
void adc_fire(emu_t *emu, int instance);
void pdb_acknowledge(emu_t *emu, int instance, int channel);
void pdb_reset(emu_t *emu);
void wdog_restart(emu_t *emu);
void lpit_fire(emu_t *emu, int channel);
void wdog_fire(emu_t *emu);
void ftfc_fire(emu_t *emu);
void ftfc_reset(emu_t *emu);
void ftfc_abort(emu_t *emu);
bool ftfc_is_busy(const emu_t *emu);
void ftfc_double_bit_fault(emu_t *emu);
void dma_fire(emu_t *emu);

/* data_flash.c */
void data_flash_create(emu_t *emu);
uint8_t *data_flash_at(emu_t *emu, uint32_t address, uint32_t size);
void data_flash_uncached(emu_t *emu);
void data_flash_reset(emu_t *emu);
uint64_t data_flash_read(uc_engine *uc, uint64_t offset, unsigned size, void *user);
void data_flash_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user);
bool clocks_high_speed(const emu_t *emu);
void can_fire(emu_t *emu);
void trgmux_event(emu_t *emu, uint32_t source);
/** A trigger that is a level: the pulse output of a delay block. */
void trgmux_level(emu_t *emu, uint32_t source, bool level);
void lpspi_request(emu_t *emu, int instance, bool level);
/** Stops the emulation unless every pin of the peripheral is multiplexed to it. */
void pins_check(emu_t *emu, const peripheral_t *peripheral);
uint32_t clocks_peripheral_ticks(const emu_t *emu, uint32_t pcc_offset);
uint32_t clocks_async_ticks(const emu_t *emu, int source, int divider);
uint32_t emu_angle(const emu_t *emu);
uint32_t emu_angle_at(const emu_t *emu, uint64_t when);
/** Follows the shaft past the encoder's index; the index's level. */
void ftm_shaft(emu_t *emu);
bool ftm_index(const emu_t *emu);
uint32_t rdc_transfer(emu_t *emu, uint64_t begin, uint32_t sent, uint32_t bits);
void rdc_power_on(emu_t *emu);
uint32_t as5047_transfer(emu_t *emu, uint64_t end, uint32_t sent, uint32_t bits);
void as5047_power_on(emu_t *emu);
void analogue_power_on(emu_t *emu);
/** Whether this input of a converter is a track of the analogue angle sensor; its count. */
bool analogue_is_at(const emu_t *emu, int instance, uint32_t input);
uint16_t analogue_count(emu_t *emu, int instance, uint64_t when);
/** Follows the output of channel 6 up to this time; before anything that may change it, and after. */
void windings_follow(emu_t *emu, uint64_t when);
void windings_changed(emu_t *emu);
/** The timer's outputs 0 ... 5 at this instant, one bit each. */
uint32_t ftm_levels(const emu_t *emu);
void rdc_sample(emu_t *emu);

/* One line per kind of peripheral. */
#define MODEL(kind) \
    bool kind##_models(uint32_t offset); \
    uint32_t kind##_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored); \
    void kind##_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
MODEL(scg);
MODEL(pcc);
MODEL(smc);
MODEL(pmc);
MODEL(rcm);
MODEL(sim);
MODEL(ftm);
MODEL(pdb);
MODEL(adc);
MODEL(lpit);
MODEL(lpspi);
MODEL(can);
MODEL(wdog);
MODEL(port);
MODEL(gpio);
MODEL(trgmux);
MODEL(lmem);
MODEL(ftfc);
MODEL(mscm);
MODEL(dma);

#endif
