/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_NVM_FILE_H
#define VECU_NVM_FILE_H
/** The virtual ECU's flash in a file: NVM_HOST_SIZE bytes. A save writes a second file and renames it, so that a
 * process that ends at any moment leaves either the previous or the new content.
 * Errors   nvm_file_load() answers false if the file exists and is not a flash; without a file the flash is unchanged.
 *          nvm_file_save() answers false if it could not write; the file is then unchanged
 * Context  simulation only */
#include <stdbool.h>

#include "hal/host/nvm_host.h"

bool nvm_file_load(const char *path, nvm_host_t *nvm);
bool nvm_file_save(const char *path, const nvm_host_t *nvm);

#endif
