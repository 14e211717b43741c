/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_NVM_FILE_H
#define VECU_NVM_FILE_H
/** The virtual ECU's flash in a file: NVM_HOST_SIZE bytes. A save writes a second file and renames it, so that a
 * process that ends at any moment leaves either the previous or the new content.
 * Errors   nvm_file_load(): false, the file is there and not a flash; none there: the flash stays as it is.
 *          nvm_file_save(): false, the file is as it was
 * Context  simulation only */
#include <stdbool.h>

#include "hal/host/nvm_host.h"

bool nvm_file_load(const char *path, nvm_host_t *nvm);
bool nvm_file_save(const char *path, const nvm_host_t *nvm);

#endif
