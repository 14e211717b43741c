/* SPDX-License-Identifier: Apache-2.0 */
#include <stddef.h>
#include <string.h>

#include "hal/host/instance.h"

typedef struct {
    const char *of; /* name of fluxtrue_get() */
    int value;      /* of a word of bits: the bit */
    const char *name, *text;
} word_t;

#define FAULT_WORD(name, value, text) {"fault_word", value, #name, text},
#define DERATING_WORD(name, value, text) {"derating", value, #name, text},
#define RUN_STATE_WORD(name, value, text) {"run_state", value, #name, text},
#define PHASE_WORD(name, value, text) {"commission", value, #name, text},
#define FAILURE_WORD(name, value, text) {"commission_failure", value, #name, text},
#define PULSES_PHASE_WORD(name, value, text) {"pulses", value, #name, text},
#define PULSES_FAILURE_WORD(name, value, text) {"pulses_failure", value, #name, text},
#define SPIN_FAILURE_WORD(name, value, text) {"spin_failure", value, #name, text},
#define MOTOR_CHECK_WORD(name, value, text) {"motor_check", value, #name, text},

static const word_t words[] = {FAULT_LIST(FAULT_WORD) DERATING_LIST(DERATING_WORD) RUN_STATE_LIST(RUN_STATE_WORD)
                                   COMMISSION_PHASE_LIST(PHASE_WORD) COMMISSION_FAILURE_LIST(FAILURE_WORD)
                                       PULSES_PHASE_LIST(PULSES_PHASE_WORD) PULSES_FAILURE_LIST(PULSES_FAILURE_WORD)
                                           SPIN_FAILURE_LIST(SPIN_FAILURE_WORD) MOTOR_CHECK_LIST(MOTOR_CHECK_WORD)};

static const word_t *find(const char *of, int value)
{
    for (size_t n = 0; of && n < sizeof words / sizeof words[0]; n++) {
        if (words[n].value == value && strcmp(words[n].of, of) == 0) {
            return &words[n];
        }
    }
    return NULL;
}

static char lower(char c)
{
    return (c >= 'A' && c <= 'Z') ? (char)(c - 'A' + 'a') : c;
}

int fluxtrue_word(const char *name, int value, char *word, int size)
{
    const word_t *found = find(name, value);
    if (!found) {
        return FLUXTRUE_UNKNOWN_NAME;
    }
    const size_t length = strlen(found->name);
    if (size <= 0 || length >= (size_t)size) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    for (size_t k = 0; k <= length; k++) {
        word[k] = lower(found->name[k]);
    }
    return FLUXTRUE_OK;
}

const char *fluxtrue_explanation(const char *name, int value)
{
    const word_t *found = find(name, value);
    return found ? found->text : NULL;
}
